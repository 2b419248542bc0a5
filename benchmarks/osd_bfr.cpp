// Limit surface of a Catmull-Clark mesh with OpenSubdiv's Bfr, sampled face by face: an OBJ in, a binary PLY with
// float positions and normals out. The fastest that Bfr does as we know it: one tessellation for each size of face,
// one surface object, single precision, a large buffer.
//
//     osd_bfr IN.obj OUT.ply RATE        (RATE segments for each edge)
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/bfr/tessellation.h>
#include <opensubdiv/far/topologyDescriptor.h>

namespace Bfr = OpenSubdiv::Bfr;
namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

struct Mesh {
    std::vector<float> positions;
    std::vector<int> sizes, corners;
};

// Samples and facets of the faces with one number of sides.
struct Pattern {
    int points, facets;
    std::vector<float> coords;
    std::vector<int> indices;
};

// A file with a buffer of its own.
class Output {
public:
    explicit Output(const char *path) : file_(std::fopen(path, "wb")) {
        if (!file_) fail("cannot write the output");
        buffer_.reserve(kSize);
    }
    ~Output() {
        flush();
        std::fclose(file_);
    }
    // Room for some bytes, to be filled by the caller at once.
    char *room(size_t bytes) {
        if (buffer_.size() + bytes > kSize) flush();
        size_t old = buffer_.size();
        buffer_.resize(old + bytes);
        return buffer_.data() + old;
    }
    [[noreturn]] static void fail(const char *text) {
        std::fprintf(stderr, "osd_bfr: %s\n", text);
        std::exit(2);
    }

private:
    void flush() {
        if (std::fwrite(buffer_.data(), 1, buffer_.size(), file_) != buffer_.size()) fail("cannot write the output");
        buffer_.clear();
    }
    static constexpr size_t kSize = 4 << 20;
    std::FILE *file_;
    std::vector<char> buffer_;
};

static std::string read_text(const char *path) {
    std::FILE *file = std::fopen(path, "rb");
    if (!file) Output::fail("cannot read the input");
    std::fseek(file, 0, SEEK_END);
    std::string text(static_cast<size_t>(std::ftell(file)), '\0');
    std::rewind(file);
    if (std::fread(text.data(), 1, text.size(), file) != text.size()) Output::fail("cannot read the input");
    std::fclose(file);
    return text;
}

// Positions and faces of a plain OBJ file ("v x y z" and "f a b c ...").
static Mesh read_obj(const char *path) {
    Mesh mesh;
    std::string text = read_text(path);
    char *at = text.data();
    while (*at) {
        char *next = std::strchr(at, '\n');
        if (next) *next = '\0';
        if (at[0] == 'v' && at[1] == ' ') {
            ++at;
            for (int i = 0; i < 3; ++i) mesh.positions.push_back(std::strtof(at, &at));
        } else if (at[0] == 'f' && at[1] == ' ') {
            int size = 0;
            char *end;
            for (++at;; at = end, ++size) {
                long corner = std::strtol(at, &end, 10);
                if (end == at) break;
                mesh.corners.push_back(static_cast<int>(corner) - 1);
            }
            mesh.sizes.push_back(size);
        }
        if (!next) break;
        at = next + 1;
    }
    return mesh;
}

static std::unique_ptr<Far::TopologyRefiner> make_refiner(const Mesh &mesh) {
    Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(mesh.positions.size() / 3);
    descriptor.numFaces = static_cast<int>(mesh.sizes.size());
    descriptor.numVertsPerFace = mesh.sizes.data();
    descriptor.vertIndicesPerFace = mesh.corners.data();
    Sdc::Options options;
    options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    std::unique_ptr<Far::TopologyRefiner> refiner(
        Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_CATMARK, options)));
    if (!refiner) Output::fail("the mesh cannot be subdivided");
    return refiner;
}

static Pattern make_pattern(int sides, int rate) {
    Bfr::Parameterization domain(Sdc::SCHEME_CATMARK, sides);
    Bfr::Tessellation::Options options;
    options.SetFacetSize(4).PreserveQuads(true);
    Bfr::Tessellation tessellation(domain, rate, options);
    Pattern pattern;
    pattern.points = tessellation.GetNumCoords();
    pattern.facets = tessellation.GetNumFacets();
    pattern.coords.resize(2 * static_cast<size_t>(pattern.points));
    pattern.indices.resize(4 * static_cast<size_t>(pattern.facets));
    tessellation.GetCoords(pattern.coords.data());
    tessellation.GetFacets(pattern.indices.data());
    return pattern;
}

// Position and unit normal at every sample of a pattern: six floats each.
static void evaluate(const Bfr::Surface<float> &surface, const Pattern &pattern, const std::vector<float> &points,
                     float *out) {
    for (int i = 0; i < pattern.points; ++i, out += 6) {
        float u[3], v[3];
        surface.Evaluate(&pattern.coords[2 * i], points.data(), 3, out, u, v);
        float x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
        float length = std::sqrt(x * x + y * y + z * z), scale = length > 0 ? 1 / length : 0;
        out[3] = x * scale;
        out[4] = y * scale;
        out[5] = z * scale;
    }
}

static void write_facets(const Pattern &pattern, int first, Output &out) {
    char *to = out.room(17 * static_cast<size_t>(pattern.facets));
    for (int i = 0; i < pattern.facets; ++i, to += 17) {
        int32_t corners[4];
        for (int k = 0; k < 4; ++k) corners[k] = pattern.indices[4 * i + k] + first;
        to[0] = 4;
        std::memcpy(to + 1, corners, sizeof corners);
    }
}

int main(int count, char **arguments) {
    if (count != 4) Output::fail("usage: osd_bfr IN.obj OUT.ply RATE");
    Mesh mesh = read_obj(arguments[1]);
    std::unique_ptr<Far::TopologyRefiner> refiner = make_refiner(mesh);
    Bfr::RefinerSurfaceFactory<> factory(*refiner);

    std::map<int, Pattern> patterns;
    long long vertices = 0, facets = 0;
    for (int size : mesh.sizes) {
        auto found = patterns.find(size);
        if (found == patterns.end()) found = patterns.emplace(size, make_pattern(size, std::atoi(arguments[3]))).first;
        vertices += found->second.points;
        facets += found->second.facets;
    }

    Output out(arguments[2]);
    std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices);
    for (const char *name : {"x", "y", "z", "nx", "ny", "nz"}) header += std::string("\nproperty float ") + name;
    header += "\nelement face " + std::to_string(facets) + "\nproperty list uchar int vertex_indices\nend_header\n";
    std::memcpy(out.room(header.size()), header.data(), header.size());

    Bfr::Surface<float> surface;
    std::vector<float> points, samples;
    for (size_t face = 0; face < mesh.sizes.size(); ++face) {
        const Pattern &pattern = patterns.at(mesh.sizes[face]);
        if (!factory.InitVertexSurface(static_cast<int>(face), &surface)) Output::fail("a face has no limit surface");
        points.resize(3 * static_cast<size_t>(surface.GetNumPatchPoints()));
        surface.PreparePatchPoints(mesh.positions.data(), 3, points.data(), 3);
        samples.resize(6 * static_cast<size_t>(pattern.points));
        evaluate(surface, pattern, points, samples.data());
        std::memcpy(out.room(samples.size() * sizeof(float)), samples.data(), samples.size() * sizeof(float));
    }
    int first = 0;
    for (int size : mesh.sizes) {
        const Pattern &pattern = patterns.at(size);
        write_facets(pattern, first, out);
        first += pattern.points;
    }
    return 0;
}
