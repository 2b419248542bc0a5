// A patch's control vectors as evaluate.glsl takes them: three texels for each four columns, then, in threes, what its
// side fields are made of. A patch that single precision cannot build is all zero, and has no normals.

uniform int blocks;
uniform int first_slot;  // the first of the texels of a side that its field is made of

void column_record(int item, out vec4 texels[3]) {
    int count = blocks + size * SLOTS, row = item / count, slot = item % count;
    int first = first_corner(row);
    texels[0] = texels[1] = texels[2] = vec4(0.0);
    if (!is_built(row, first)) {
        return;
    }
#if SLOTS > 0
    if (slot >= blocks) {
        int k = (slot - blocks) / SLOTS, at = first_slot + 3 * ((slot - blocks) % SLOTS);
        for (int i = 0; i < 3; i++) {
            texels[i] = side_texel(row, k, at + i);
        }
        return;
    }
#endif
    for (int i = 0; i < 4; i++) {
        int index = 4 * slot + i;
        vec3 value = index < columns ? COLUMN(row, first, index) : vec3(0.0);
        texels[0][i] = value.x;
        texels[1][i] = value.y;
        texels[2][i] = value.z;
    }
}
