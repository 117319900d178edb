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
static void check_count(const tops &all, const doubles &given, size_t width)
{
    if (size_t(given.size()) != width * all.size())
        throw py::value_error("an array has the wrong shape");
}
// Returns rows of `width` doubles, which write(i, scene, row) writes for each top.
template <class Write> static doubles rows_of(const tops &all, size_t width, Write write)
{
    doubles out({py::ssize_t(all.size()), py::ssize_t(width)});
    double *to = out.mutable_data();
    in_pieces(py::ssize_t(all.size()), [&](py::ssize_t begin, py::ssize_t end) {
        kr_scene scene;
        for (size_t i = size_t(begin); i < size_t(end); i++) {
            all.fill(i, i + 1, &scene);
            write(i, scene, to + width * i);
        }
    });
    return out;
}
// Returns a quantity of each top at its start, as rows of doubles.
static doubles start_values(const tops &all, const std::string &name)
{
    const kr_quantity *quantity = kr_quantity_find(name.c_str());
    if (!quantity) throw py::key_error(name);
    return rows_of(all, quantity->doubles, [&](size_t, kr_scene &scene, double *row) {
        kr_quantity_values(quantity, &scene, 1, &scene.start, row);
    });
}
// Returns the momenta of tops that start with `vectors`, of the kind with this index in set_start.
static doubles momenta(const tops &all, size_t kind, const doubles &vectors)
{
    check_count(all, vectors, 3);
    const double *v = vectors.data();
    return rows_of(all, 3, [&](size_t i, kr_scene &scene, double *row) {
        set_start[kind](&scene, {v[3 * i], v[3 * i + 1], v[3 * i + 2]});
        std::memcpy(row, &scene.start.m, sizeof scene.start.m);
    });
}
// Returns the attitudes and momenta of tops with these Euler angles and rates, as rows.
static doubles euler_starts(const tops &all, const doubles &angles, const doubles &rates)
{
    check_count(all, angles, 3);
    check_count(all, rates, 3);
    const double *a = angles.data(), *r = rates.data();
    return rows_of(all, 7, [&](size_t i, kr_scene &scene, double *row) {
        kr_scene_set_euler(&scene, {a[3 * i], a[3 * i + 1], a[3 * i + 2]},
                           {r[3 * i], r[3 * i + 1], r[3 * i + 2]});
        std::memcpy(row, &scene.start.q, sizeof scene.start.q);
        std::memcpy(row + 4, &scene.start.m, sizeof scene.start.m);
    });
}
// Returns for each top the rate of its steady precession, NaN if there is none, and the smallest
// spin that would have one.
static doubles steady(const tops &all, const doubles &spins, const doubles &tilts, bool is_fast)
{
    check_count(all, spins, 1);
    check_count(all, tilts, 1);
    const double *spin = spins.data(), *tilt = tilts.data();
    return rows_of(all, 2, [&](size_t i, kr_scene &scene, double *row) {
        if (kr_scene_steady_precession(&scene, spin[i], tilt[i], is_fast, row, row + 1) != KR_OK)
            row[0] = NAN;
    });
}
// Returns (n, 2) moments of inertia across and along the apex, NaN for bodies that are not symmetric.
static doubles symmetric(const tops &all)
{
    return rows_of(all, 2, [](size_t, kr_scene &scene, double *row) {
        if (!kr_body_symmetry(&scene.body, row, row + 1)) row[0] = row[1] = NAN;
    });
}

// Makes bodies from mass, inertia (moments, or the rows of a matrix), com, inertia_rtol and rotor.
// Returns the status and index of the first invalid body, whether each body is physical, and the
// blocks of the bodies that are given by matrices, without these matrices.
static py::tuple bodies(const std::vector<size_t> &shape, const py::list &given, bool are_matrices)
{
    const columns<5> all(shape, given, {1, are_matrices ? size_t(9) : size_t(3), 3, 1, 3});
    const size_t size = offsetof(kr_body, given);
    const auto n = py::ssize_t(all.size()), width = py::ssize_t(size / sizeof(double));
    py::array_t<bool> can_be(n);
    doubles blocks({are_matrices ? n : 0, width});
    bool *can = can_be.mutable_data();
    double *to = blocks.mutable_data();
    std::pair<size_t, kr_status> found{all.size(), KR_OK};
    in_pieces(n, [&](py::ssize_t begin, py::ssize_t end) {
        all.walk(size_t(begin), size_t(end), [&](size_t i, const double *numbers) {
            if (found.second != KR_OK) return;
            const double *j = numbers + 1, *com = are_matrices ? j + 9 : j + 3;
            const double diagonal[9] = {j[0], 0.0, 0.0, 0.0, j[1], 0.0, 0.0, 0.0, j[2]};
            kr_body body = {};
            const kr_status status = kr_body_from_tensor(numbers[0], are_matrices ? j : diagonal,
                                                         {com[0], com[1], com[2]}, com[3], &body);
            if (status != KR_OK) found = {i, status};
            kr_body_set_rotor(&body, {com[4], com[5], com[6]});
            can[i] = kr_body_is_physical(&body) != 0;
            if (are_matrices) std::memcpy(to + size_t(width) * i, &body, size);
        });
    });
    return py::make_tuple(name_of(found.second), found.first, can_be, blocks);
}

// Returns mass, moments about the centre of mass and position of this centre of homogeneous bodies,
// as rows. The columns are three sizes and the masses or, if `are_dense`, the densities.
static doubles shapes(int kind, const std::vector<size_t> &over, const py::list &given,
                      bool are_dense)
{
    const columns<4> all(over, given, {1, 1, 1, 1});
    std::vector<py::ssize_t> rows(over.begin(), over.end());
    rows.push_back(7);
    doubles out(rows);
    double *to = out.mutable_data();
    in_pieces(py::ssize_t(all.size()), [&](py::ssize_t begin, py::ssize_t end) {
        all.walk(size_t(begin), size_t(end), [&](size_t i, const double *numbers) {
            const kr_vec3 size = {numbers[0], numbers[1], numbers[2]};
            const auto shape = kr_shape(kind);
            const double mass = are_dense ? kr_shape_mass(shape, size, numbers[3]) : numbers[3];
            double height;
            const kr_vec3 j = kr_shape_inertia(shape, size, mass, &height);
            const double row[7] = {mass, j.x, j.y, j.z, 0.0, 0.0, height};
            std::memcpy(to + 7 * i, row, sizeof row);
        });
    });
    return out;
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
        .def("values", start_values, "name"_a)
        .def("momenta", momenta, "kind"_a, "vectors"_a)
        .def("euler", euler_starts, "angles"_a, "rates"_a)
        .def("steady", steady, "spins"_a, "tilts"_a, "is_fast"_a)
        .def("symmetric", symmetric);
    m.def("bodies", bodies, "shape"_a, "columns"_a, "are_matrices"_a);
    m.def("shapes", shapes, "kind"_a, "shape"_a, "columns"_a, "are_dense"_a);
    m.def("cosine", py::vectorize(cosine), "x"_a);
    m.def("sine", py::vectorize(sine), "x"_a);
    m.def("logarithm", py::vectorize(logarithm), "x"_a);
}
