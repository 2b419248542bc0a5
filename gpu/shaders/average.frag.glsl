#version 330 core
// Each pixel the average of a square of pixels drawn finer.

uniform sampler2D drawn;
uniform int finer;

out vec4 color;

void main() {
    ivec2 first = finer * ivec2(gl_FragCoord.xy);
    vec4 total = vec4(0.0);
    for (int y = 0; y < finer; ++y)
        for (int x = 0; x < finer; ++x)
            total += texelFetch(drawn, first + ivec2(x, y), 0);
    color = total / float(finer * finer);
}
