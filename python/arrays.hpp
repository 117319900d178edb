// Values of kreisel.h as arrays of the doubles that they are made of, and statuses as names. Floor 5.
#pragma once
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <cstring>
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

// Arrays in and out.
template <class T> inline T value_of(const doubles &a)
{
    T value;
    if (a.nbytes() != sizeof value) throw py::value_error("an array of doubles has the wrong size");
    std::memcpy(&value, a.data(), sizeof value);
    return value;
}
template <class T> inline doubles array_of(const T &value)
{
    doubles a(py::ssize_t(sizeof value / sizeof(double)));
    std::memcpy(a.mutable_data(), &value, sizeof value);
    return a;
}
