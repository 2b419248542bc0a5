#version 330 core
// A line of some width in pixels: four corners around its two ends, half a width and a pixel beyond them. Ends that
// coincide make a dot.

uniform mat4 view;
uniform mat4 projection;
uniform vec2 pixels;     // width and height of the picture
uniform float width;

in vec3 in_start;
in vec3 in_end;

flat out vec2 start;     // ends in pixels
flat out vec2 end;

void main() {
    vec4 from = projection * view * vec4(in_start, 1.0), to = projection * view * vec4(in_end, 1.0);
    start = (0.5 + 0.5 * from.xy / from.w) * pixels;
    end = (0.5 + 0.5 * to.xy / to.w) * pixels;
    float size = distance(start, end);
    vec2 along = size > 1e-4 ? (end - start) / size : vec2(1.0, 0.0);
    bool last = gl_VertexID >= 2;
    float side = float(gl_VertexID % 2) * 2.0 - 1.0, reach = 0.5 * width + 1.0;
    vec2 corner = (last ? end : start) + reach * (side * vec2(-along.y, along.x) + (last ? along : -along));
    vec4 here = last ? to : from;
    gl_Position = vec4((corner / pixels * 2.0 - 1.0) * here.w, here.zw);
}
