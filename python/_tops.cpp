// Many tops: what of them is looked at all at once.
#include "tops.hpp"
#include <pybind11/stl.h>

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

void bind_tops(py::module_ &m);
void bind_tops(py::module_ &m)
{
    py::class_<tops>(m, "Tops")
        .def(py::init<std::vector<size_t>, py::list>(), "shape"_a, "columns"_a)
        .def("__len__", &tops::size)
        .def("check", check)
        .def("block", block, "index"_a);
}
