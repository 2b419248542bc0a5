// The same for devices without: a vertex is a record, captured by transform feedback.

uniform int first_item;
out vec4 texels[TEXELS];

void main() {
    vec4 made[TEXELS];
    RECORD(first_item + gl_VertexID, made);
    texels = made;
}
