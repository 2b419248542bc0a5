#version 330 core
// The styles of a surface, in linear light; eye coordinates: x right, y up, z towards the viewer.

const int SHADED = 0, ZEBRA = 1, NORMALS = 2, VALUES = 3;
const int STOPS = 9;

uniform int style;
uniform mat4 view;
uniform bool perspective;
uniform vec3 front_color;
uniform vec3 back_color;
uniform float stripes;       // dark bands from the floor to the ceiling
uniform vec3 stops[STOPS];   // colors of values from 0 to 1
uniform vec3 no_value_color;

in vec3 position;
in vec3 normal;
in vec3 world_normal;
in float value;

out vec4 color;

// The facet's own normal, turned to the viewer.
vec3 facet_normal(vec3 towards_eye) {
    vec3 facet = normalize(cross(dFdx(position), dFdy(position)));
    return dot(facet, towards_eye) < 0.0 ? -facet : facet;
}

// The normal to shade with: on the viewer's side of the facet, whichever way the mesh is wound.
vec3 shading_normal(vec3 facet) {
    float size = length(normal);
    if (!(size > 1e-6)) return facet;
    vec3 unit = normal / size;
    return dot(unit, facet) < 0.0 ? -unit : unit;
}

// A lamp of some size: light reaches a little around the edge of its shadow.
float lamp(vec3 n, vec3 direction, float softness) {
    float cosine = (dot(n, normalize(direction)) + softness) / (1.0 + softness);
    return max(cosine, 0.0);
}

// Key light from the upper left, fill light from the right, and a bright room around.
vec3 lit(vec3 base, vec3 n, vec3 towards_eye) {
    const vec3 key = vec3(-0.50, 0.68, 0.60), fill = vec3(0.85, 0.05, 0.55);
    vec3 room = mix(vec3(0.15, 0.14, 0.14), vec3(0.31, 0.32, 0.34), 0.5 + 0.5 * n.y);
    vec3 light = room + 0.88 * lamp(n, key, 0.15) + vec3(0.13, 0.14, 0.16) * lamp(n, fill, 0.40);
    vec3 halfway = normalize(normalize(key) + towards_eye);
    float gloss = 0.12 * pow(max(dot(n, halfway), 0.0), 50.0);
    float rim = 0.10 * pow(1.0 - max(dot(n, towards_eye), 0.0), 4.0);
    return base * light + gloss + rim;
}

// Share of a window of a width that lies in the first halves of periods of length 1: the square wave averaged.
float dark_share(float at, float width) {
    float low = at - 0.5 * width, high = at + 0.5 * width;
    float below = 0.5 * floor(low) + min(fract(low), 0.5);
    float above = 0.5 * floor(high) + min(fract(high), 0.5);
    return (above - below) / width;
}

// Reflection lines: the surface mirrors a room whose walls are striped in level bands, cut by planes that are evenly
// apart. The height of the reflected ray tells the band, its change from pixel to pixel how much of it each one sees.
float dark_band(vec3 n, vec3 towards_eye) {
    float at = 0.5 * stripes * reflect(-towards_eye, n).y;
    float width = clamp(length(vec2(dFdx(at), dFdy(at))), 1e-4, 1e4);
    return dark_share(at + 0.25, width);
}

vec3 value_color(float share) {
    if (isnan(share)) return no_value_color;
    float at = clamp(share, 0.0, 1.0) * float(STOPS - 1);
    int low = min(int(at), STOPS - 2);
    return mix(stops[low], stops[low + 1], at - float(low));
}

// What a screen shows as a number, in linear light.
vec3 linear(vec3 shown) {
    return mix(shown / 12.92, pow((shown + 0.055) / 1.055, vec3(2.4)), step(0.04045, shown));
}

void main() {
    vec3 towards_eye = perspective ? normalize(-position) : vec3(0.0, 0.0, 1.0);
    vec3 facet = facet_normal(towards_eye), n = shading_normal(facet);
    if (style == NORMALS) {
        vec3 own = length(normal) > 1e-6 ? normalize(world_normal) : facet * mat3(view);
        color = vec4(linear(0.5 + 0.5 * own), 1.0);
        return;
    }
    vec3 base = gl_FrontFacing ? front_color : back_color;
    if (style == VALUES) {
        // Light from the eye alone, and little shade: a color has to be found again in the scale.
        color = vec4(value_color(value) * (0.7 + 0.3 * max(dot(n, towards_eye), 0.0)), 1.0);
        return;
    }
    if (style == ZEBRA) base = mix(vec3(0.80), vec3(0.012), dark_band(n, towards_eye));
    color = vec4(lit(base, n, towards_eye), 1.0);
}
