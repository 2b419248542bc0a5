// The blending surface by the unified procedure of Ko, Lee, Lim, Yoon, section V: one evaluation for charts and local
// geometries of every kind, in faces and on edges. The CPU's twins are in core/schemes/blend_basis.py; there
// coefficients turn with a chart, here its coordinates do.

uniform sampler2D coefficients;  // nine texels a chart; see gpu/blend.py for what stands beside the vectors
uniform isampler2D corners;      // chart of each corner of the quads, and its place there
uniform isampler2D starts;       // the corner at (0, 0) of each patch; ~corner: u runs the other way
uniform sampler2D parameters;    // (u, v) of each sample
uniform int patches;
uniform int samples;

const float QUARTER = 1.57079632679;
// Normals are lost where they are shorter than this share of the larger derivative times the sizes of the terms that the
// derivatives are sums of: there rounding shows, and the CPU looks at them again.
const float LOST = 1e-3;

// Texel i of a row that is folded into a texture.
ivec2 folded(int i, int width) {
    return ivec2(i % width, i / width);
}

vec2 complex_product(vec2 a, vec2 b) {
    return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

// The blending function and its derivative.
vec2 weight(float t) {
#if ORDER == 3
    return vec2(1.0 + t * t * (2.0 * t - 3.0), -6.0 * t * (1.0 - t));
#else
    float product = t * (1.0 - t);
    return vec2(1.0 - t * t * t * (10.0 - 15.0 * t + 6.0 * t * t), -30.0 * product * product);
#endif
}

// Chart coordinates and their derivatives by x and y, in a face that is ``place`` faces on from the chart's first.
// At r = 0 r^(A-1) counts as 1.
void chart_jets(vec2 exponents, float place, vec2 at, out vec2 jets[3]) {
    float r = length(at);
    bool away = r > 0.0;
    vec2 direction = away ? at / r : vec2(1.0, 0.0);
    float theta = atan(direction.y, direction.x);
    float speed = pow(away ? r : 1.0, exponents.x - 1.0);
    float angle = exponents.y * (theta + QUARTER * place);
    vec2 turn = speed * vec2(cos(angle), sin(angle));
    jets[0] = r * turn;
    jets[1] = complex_product(turn, vec2(exponents.x * direction.x, -exponents.y * direction.y));
    jets[2] = complex_product(turn, vec2(exponents.x * direction.y, exponents.y * direction.x));
}

// A chart's local geometry times its weights, with derivatives by x and y: equations (1), (2).
void corner_jets(vec3 c[9], vec2 exponents, float place, vec2 at, out vec3 jets[3]) {
    vec2 chart[3];
    chart_jets(exponents, place, at, chart);
    float x = chart[0].x;
    float y = chart[0].y;
    vec3 rows[3];
    vec3 slopes[3];
    for (int i = 0; i < 3; i++) {
        rows[i] = c[3 * i] + y * (c[3 * i + 1] + y * c[3 * i + 2]);
        slopes[i] = c[3 * i + 1] + 2.0 * y * c[3 * i + 2];
    }
    vec3 point = rows[0] + x * (rows[1] + x * rows[2]);
    vec3 by_first = rows[1] + 2.0 * x * rows[2];
    vec3 by_second = slopes[0] + x * (slopes[1] + x * slopes[2]);
    vec2 wx = weight(at.x);
    vec2 wy = weight(at.y);
    float blend = wx.x * wy.x;
    jets[0] = blend * point;
    jets[1] = wx.y * wy.x * point + blend * (by_first * chart[1].x + by_second * chart[1].y);
    jets[2] = wx.x * wy.y * point + blend * (by_first * chart[2].x + by_second * chart[2].y);
}

// Unit cross product of two derivatives, or zero where it is lost; ``reach`` adds up the sizes of their terms.
vec3 cross_normals(vec3 by_u, vec3 by_v, float reach) {
    vec3 normal = cross(by_u, by_v);
    float square = dot(normal, normal);
    float least = LOST * reach;
    bool there = square > least * least * max(dot(by_u, by_u), dot(by_v, by_v));
    return there ? normal * inversesqrt(square) : vec3(0.0);
}

// The surface at SAMPLES samples of a patch: value, relative to the first corner's vertex, and derivatives by u and v,
// and the sizes of the terms of these. Samples beyond the last repeat it.
void face_jets(int row, int first_sample, out vec3 jets[3 * SAMPLES], out float reach[SAMPLES]) {
    int start = texelFetch(starts, folded(row, textureSize(starts, 0).x), 0).x;
    bool backward = start < 0;
    start = backward ? ~start : start;
    vec2 uv[SAMPLES];
    for (int s = 0; s < SAMPLES; s++) {
        uv[s] = texelFetch(parameters, folded(min(first_sample + s, samples - 1), textureSize(parameters, 0).x), 0).xy;
        uv[s].x = backward ? 1.0 - uv[s].x : uv[s].x;
        jets[3 * s] = jets[3 * s + 1] = jets[3 * s + 2] = vec3(0.0);
        reach[s] = 0.0;
    }
    int charts = textureSize(coefficients, 0).x / 9;
    vec3 origin = vec3(0.0);
    for (int corner = 0; corner < 4; corner++) {
        int which = start - start % 4 + (start + corner) % 4;
        ivec2 chart = texelFetch(corners, folded(which, textureSize(corners, 0).x), 0).xy;
        ivec2 begin = folded(chart.x, charts) * ivec2(9, 1);
        vec4 texels[9];
        vec3 c[9];
        for (int i = 0; i < 9; i++) {
            texels[i] = texelFetch(coefficients, begin + ivec2(i, 0), 0);
            c[i] = texels[i].xyz;
        }
        origin = corner == 0 ? c[0] : origin;
        c[0] = (c[0] - origin) + vec3(texels[0].w, texels[1].w, texels[2].w);
        vec2 exponents = vec2(texels[3].w, texels[4].w);
        for (int s = 0; s < SAMPLES; s++) {
            vec2 near = uv[s];
            vec2 far = 1.0 - near;
            vec2 at = corner == 0 ? near : corner == 1 ? vec2(near.y, far.x) : corner == 2 ? far : vec2(far.y, near.x);
            vec3 own[3];
            corner_jets(c, exponents, float(chart.y), at, own);
            vec3 by_u = corner % 2 == 0 ? own[1] : -own[2];
            vec3 by_v = corner % 2 == 0 ? own[2] : own[1];
            jets[3 * s] += own[0];
            jets[3 * s + 1] += corner < 2 ? by_u : -by_u;
            jets[3 * s + 2] += corner < 2 ? by_v : -by_v;
            reach[s] += dot(abs(own[1]) + abs(own[2]), vec3(1.0));
        }
    }
}
