// Unit edge normals as side fields: the paper's approximate normals; twins of NormalControls in core/schemes/gregory.py.

#include "controls"

struct Side {
    mat3x4 field;
};

Side read_side(int at) {
    return Side(control_texels(at));
}

vec3 fields(Side side, float t) {
    return unit_rows(bernstein_basis(t) * side.field);
}
