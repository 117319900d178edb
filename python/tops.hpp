// Many tops as columns: arrays that broadcast to one shape, so that numbers common to many tops are
// stored once. Scenes are assembled a few at a time, when they are needed.
#pragma once
#include <algorithm>
#include <array>
#include <vector>
#include "arrays.hpp"

// N arrays of doubles over one shape, each with a fixed number of doubles per member, traversed
// together in C order. They broadcast to the shape: a column that does not vary has the stride zero.
template <size_t N> class columns
{
    struct column {
        py::array kept; // keeps the numbers alive while they are read
        const char *data;
        std::vector<py::ssize_t> strides; // along the shape
        py::ssize_t step, inner; // along the last dimension, and between the numbers of a member
        size_t width;
    };
    std::vector<size_t> shape;
    std::array<column, N> all;
    size_t count = 1;

    static column column_of(const py::array &given, const std::vector<size_t> &shape, size_t width)
    {
        const size_t dims = shape.size(), inner = width > 1, own = size_t(given.ndim()) - inner;
        bool fits = py::isinstance<py::array_t<double>>(given) &&
                    (given.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_) != 0 &&
                    size_t(given.ndim()) >= inner && own <= dims;
        column made = {given, nullptr, std::vector<py::ssize_t>(dims), 0, 0, width};
        for (size_t d = 0; fits && d < own; d++) {
            const size_t n = size_t(given.shape(py::ssize_t(d))), place = dims - own + d;
            if (n != 1) made.strides[place] = given.strides(py::ssize_t(d));
            fits = n == 1 || n == shape[place];
        }
        if (!fits || (inner && given.shape(py::ssize_t(own)) != py::ssize_t(width)))
            throw py::value_error("a column has the wrong shape or type");
        made.data = static_cast<const char *>(given.data());
        if (dims > 0) made.step = made.strides.back();
        if (inner) made.inner = given.strides(py::ssize_t(own));
        return made;
    }
    void find(size_t index, const char *(&at)[N]) const
    {
        for (size_t k = 0; k < N; k++) at[k] = all[k].data;
        for (size_t d = shape.size(); d-- > 0; index /= shape[d])
            for (size_t k = 0; k < N; k++)
                at[k] += all[k].strides[d] * py::ssize_t(index % shape[d]);
    }

  public:
    columns(const std::vector<size_t> &over, const py::list &given,
            const std::array<size_t, N> &widths)
        : shape(over)
    {
        if (given.size() != N) throw py::value_error("there are other columns than these");
        for (size_t k = 0; k < N; k++)
            all[k] = column_of(py::cast<py::array>(given[k]), shape, widths[k]);
        for (const size_t n : shape) count *= n;
    }
    size_t size() const { return count; }
    // Returns true if all members have the same numbers in a column.
    bool is_shared(size_t k) const
    {
        const auto &strides = all[k].strides;
        return std::all_of(strides.begin(), strides.end(), [](py::ssize_t s) { return s == 0; });
    }

    // Assembles the numbers of the members begin to end in the order of the struct, and calls
    // use(index, numbers) for each.
    template <class Use> void walk(size_t begin, size_t end, Use use) const
    {
        const size_t last = shape.empty() ? 1 : shape.back();
        const char *at[N];
        while (begin < end) {
            find(begin, at);
            const size_t stop = std::min(end, begin - begin % last + last);
            for (; begin < stop; begin++) {
                double numbers[8 * N], *to = numbers;
                for (size_t k = 0; k < N; at[k] += all[k].step, k++)
                    for (size_t j = 0; j < all[k].width; j++)
                        *to++ = *reinterpret_cast<const double *>(at[k] +
                                                                  py::ssize_t(j) * all[k].inner);
                use(begin, numbers);
            }
        }
    }
};

// The functions that set the start of a scene from a momentum, velocity, body_momentum or
// body_velocity.
static void (*const set_start[])(kr_scene *, kr_vec3) = {
    [](kr_scene *scene, kr_vec3 momentum) { scene->start.m = momentum; }, kr_scene_set_velocity,
    kr_scene_set_body_momentum, kr_scene_set_body_velocity};

// Returns the kind of a top. Without gravity, its centre of mass counts as the fixed point.
inline kr_kind kind_of(const kr_scene &scene)
{
    kr_body body = scene.body;
    if (scene.gravity == 0.0) body.com = kr_vec3{0.0, 0.0, 0.0};
    return kr_body_kind(&body, KR_KIND_RTOL);
}
// Returns true for Kowalewski and Goryachev-Chaplygin tops under gravity, and for free gyrostats.
inline bool has_torus(const kr_scene &scene) { return kind_of(scene) >= KR_KIND_KOWALEWSKI; }

// Scenes, with the fields of a kr_scene in its order.
class tops
{
    columns<19> fields;

  public:
    // Mass, moments, centre of mass, axes, inertia_rtol, rotor; inertia, centre of mass and rotor as
    // given by matrices, or zeros; gravity; t, q, m; damping, turning, shaking, friction, wheels,
    // gradient.
    tops(const std::vector<size_t> &shape, const py::list &arrays)
        : fields(shape, arrays, {1, 3, 3, 4, 1, 3, 9, 3, 3, 1, 1, 4, 3, 3, 3, 3, 1, 12, 1})
    {
    }
    size_t size() const { return fields.size(); }
    // Returns true if all members have the same body and environment.
    bool differ_in_starts_alone() const
    {
        bool shared = true;
        for (size_t k = 0; k < 10; k++) shared = shared && fields.is_shared(k);
        for (size_t k = 13; k < 19; k++) shared = shared && fields.is_shared(k);
        return shared;
    }

    // Assembles the scenes begin to end in C order of the shape, on any thread, without the GIL.
    void fill(size_t begin, size_t end, kr_scene *out) const
    {
        fields.walk(begin, end, [&](size_t, const double *numbers) {
            std::memcpy(out++, numbers, sizeof *out);
        });
    }
    // Returns the index of the first invalid scene and its status; KR_OK if all are valid.
    std::pair<size_t, kr_status> first_bad() const
    {
        std::pair<size_t, kr_status> found{size(), KR_OK};
        in_pieces(py::ssize_t(size()), [&](py::ssize_t begin, py::ssize_t end) {
            fields.walk(size_t(begin), size_t(end), [&](size_t i, const double *numbers) {
                kr_scene scene;
                std::memcpy(&scene, numbers, sizeof scene);
                const kr_status status =
                    found.second == KR_OK ? kr_scene_check(&scene) : found.second;
                if (status != found.second) found = {i, status};
            });
        });
        return found;
    }
};
