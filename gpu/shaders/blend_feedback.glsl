// Entry for devices without compute shaders: the paper's vertex program, captured by transform feedback.

out vec3 value;
out vec3 normal;

void main() {
    vec3 jets[3];
    float reach[1];
    face_jets(gl_VertexID / samples, gl_VertexID % samples, jets, reach);
    value = jets[0];
    normal = cross_normals(jets[1], jets[2], reach[0]);
}
