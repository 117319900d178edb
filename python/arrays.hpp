// Values of kreisel.h as arrays of the doubles that they are made of, and statuses as names.
#pragma once
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <algorithm>
#include <cstring>
#include <string>
#include "kreisel.h"
namespace py = pybind11;
using namespace py::literals;
using doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

[[maybe_unused]] static const struct { const char *name, *what, *text; } statuses[] = {
#define X(name, what, text) {#name, #what, text},
    KR_STATUS_LIST(X)
#undef X
};
inline const char *name_of(kr_status status) { return statuses[status].name; }

inline const kr_method *method_of(const std::string &name)
{
    const kr_method *method = kr_method_find(name.c_str());
    if (!method) throw py::key_error(name);
    return method;
}

// What takes microseconds at most for each of n, with the GIL released, and signals looked for every few milliseconds.
template <class Work> inline void in_pieces(py::ssize_t n, Work work)
{
    const py::ssize_t piece = 1 << 15;
    for (py::ssize_t i = 0; i < n; i += piece) {
        if (i > 0 && PyErr_CheckSignals() != 0) throw py::error_already_set();
        py::gil_scoped_release nogil;
        work(i, std::min(n, i + piece));
    }
}

// Values in and out: in as the bytes of one, or as a row of the doubles that it is made of.
static_assert(sizeof(kr_state) == 8 * sizeof(double) && sizeof(kr_scene) == 20 * sizeof(double), "plain doubles");
template <class T> inline T value_in(const void *memory, py::ssize_t size)
{
    T value;
    if (size != py::ssize_t(sizeof value)) throw py::value_error("an array of doubles has the wrong size");
    std::memcpy(&value, memory, sizeof value);
    return value;
}
template <class T> inline T value_of(const doubles &row) { return value_in<T>(row.data(), row.nbytes()); }
template <class T> inline T value_of(const py::object &given)
{
    if (PyBytes_Check(given.ptr())) return value_in<T>(PyBytes_AS_STRING(given.ptr()), PyBytes_GET_SIZE(given.ptr()));
    return value_of<T>(given.cast<doubles>());
}
template <class T> inline doubles array_of(const T &value)
{
    doubles a(py::ssize_t(sizeof value / sizeof(double)));
    std::memcpy(a.mutable_data(), &value, sizeof value);
    return a;
}
