#version 330 core
// A line with round ends: how much of a pixel it covers follows from its distance. Premultiplied color, linear light.

uniform vec3 line_color;
uniform float opacity;
uniform float width;

flat in vec2 start;
flat in vec2 end;

out vec4 color;

void main() {
    vec2 along = end - start, place = gl_FragCoord.xy - start;
    float share = clamp(dot(place, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
    float away = distance(place, share * along);
    // Lines thinner than a pixel keep a pixel's width and fade instead.
    float covered = clamp(0.5 * max(width, 1.0) + 0.5 - away, 0.0, 1.0) * min(width, 1.0);
    if (covered <= 0.0) discard;
    color = vec4(line_color, 1.0) * (opacity * covered);
}
