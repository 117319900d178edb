// Checks and quantities of many tops and bodies in one call.
#include <cmath>
#include <pybind11/stl.h>
#include "tops.hpp"

static py::tuple check(const tops &all)
{
    const auto [index, status] = all.first_bad();
    return py::make_tuple(name_of(status), index);
}
static py::bytes block(const tops &all, size_t index)
{
    if (index >= all.size()) throw py::index_error("there are fewer tops");
    kr_scene scene;
    all.fill(index, index + 1, &scene);
    return block_of(scene);
}
// Returns a quantity of each top at its start, as rows of doubles.
static doubles start_values(const tops &all, const std::string &name)
{
    const kr_quantity *quantity = kr_quantity_find(name.c_str());
    if (!quantity) throw py::key_error(name);
    const size_t width = kr_quantity_doubles(quantity);
    doubles out({py::ssize_t(all.size()), py::ssize_t(width)});
    double *to = out.mutable_data();
    in_pieces(py::ssize_t(all.size()), [&](py::ssize_t begin, py::ssize_t end) {
        kr_scene scene;
        for (size_t i = size_t(begin); i < size_t(end); i++) {
            all.fill(i, i + 1, &scene);
            kr_quantity_values(quantity, &scene, 1, &scene.start, to + width * i);
        }
    });
    return out;
}

// Makes bodies from mass, inertia (moments, or the rows of a matrix), com, inertia_rtol and rotor.
// Returns the status and index of the first invalid body, whether each body is physical, and the
// blocks of the bodies that are given by matrices.
static py::tuple bodies(const std::vector<size_t> &shape, const py::list &given, bool are_matrices)
{
    const columns<5> all(shape, given, {1, are_matrices ? size_t(9) : size_t(3), 3, 1, 3});
    const auto n = py::ssize_t(all.size()), width = py::ssize_t(sizeof(kr_body) / sizeof(double));
    py::array_t<bool> can_be(n);
    doubles blocks({are_matrices ? n : 0, width});
    bool *can = can_be.mutable_data();
    auto *to = reinterpret_cast<kr_body *>(blocks.mutable_data());
    std::pair<size_t, kr_status> found{all.size(), KR_OK};
    in_pieces(n, [&](py::ssize_t begin, py::ssize_t end) {
        all.walk(size_t(begin), size_t(end), [&](size_t i, const double *numbers) {
            if (found.second != KR_OK) return;
            const double *j = numbers + 1, *com = are_matrices ? j + 9 : j + 3;
            const double diagonal[9] = {j[0], 0.0, 0.0, 0.0, j[1], 0.0, 0.0, 0.0, j[2]};
            kr_body body = {};
            const kr_status status = kr_body_from_rounded_tensor(
                numbers[0], are_matrices ? j : diagonal, {com[0], com[1], com[2]}, com[3], &body);
            if (status != KR_OK) found = {i, status};
            kr_body_set_rotor(&body, {com[4], com[5], com[6]});
            can[i] = kr_body_is_physical(&body) != 0;
            if (are_matrices) to[i] = body;
        });
    });
    return py::make_tuple(name_of(found.second), found.first, can_be, blocks);
}

// Functions of the C library. Those of numpy are not used, because their last bits differ between
// machines and from Python's.
static double cosine(double x) { return std::cos(x); }
static double sine(double x) { return std::sin(x); }
static double logarithm(double x) { return std::log(x); }

void bind_tops(py::module_ &m);
void bind_tops(py::module_ &m)
{
    py::class_<tops>(m, "Tops")
        .def(py::init<std::vector<size_t>, py::list>(), "shape"_a, "columns"_a)
        .def("__len__", &tops::size)
        .def("check", check)
        .def("block", block, "index"_a)
        .def("values", start_values, "name"_a);
    m.def("bodies", bodies, "shape"_a, "columns"_a, "are_matrices"_a);
    m.def("cosine", py::vectorize(cosine), "x"_a);
    m.def("sine", py::vectorize(sine), "x"_a);
    m.def("logarithm", py::vectorize(logarithm), "x"_a);
}
