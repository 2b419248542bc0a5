// Cross tangents where a patch is evaluated: read from its texels.

#include "controls"
#include "cross_tangents"

Side read_side(int at) {
#if defined(PRECISE) || defined(SMOOTH)
    return to_side(control_texels(at), control_texel(at + 3), control_texel(at + 4).xyz);
#else
    vec3 first = control_texel(at + 9).xyz, last = control_texel(at + 10).xyz;
    return Side(control_texels(at), control_texels(at + 3), control_texels(at + 6), first, last);
#endif
}
