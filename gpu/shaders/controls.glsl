// Control vectors of patches, block by block, three components each; then what their side fields are made of.

#include "records"

uniform sampler2D controls;

vec4 control_texel(int i) {
    return texelFetch(controls, place(i), 0);
}

mat3x4 control_texels(int i) {
    return mat3x4(control_texel(i), control_texel(i + 1), control_texel(i + 2));
}
