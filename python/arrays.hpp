// Conversion of the types of kreisel.h to and from Python: states and plans as arrays of doubles,
// bodies and scenes as blocks of bytes, statuses as names.
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

[[maybe_unused]] static const struct {
    const char *name, *what, *text;
} statuses[] = {
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

// Calls `work` for pieces of n items, with the GIL released. Each item may take at most
// microseconds, so that signals are checked every few milliseconds.
template <class Work> inline void in_pieces(py::ssize_t n, Work work)
{
    const py::ssize_t piece = 1 << 15;
    for (py::ssize_t i = 0; i < n; i += piece) {
        if (i > 0 && PyErr_CheckSignals() != 0) throw py::error_already_set();
        py::gil_scoped_release nogil;
        work(i, std::min(n, i + piece));
    }
}

static_assert(sizeof(kr_state) == 8 * sizeof(double), "plain doubles");
static_assert(sizeof(kr_scene) == 62 * sizeof(double), "plain doubles");

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

// Returns the address of an array's numbers, to be written in place.
template <class T> inline T *in_place(const py::handle &given, size_t count)
{
    if (!py::isinstance<py::array_t<T, py::array::c_style>>(given))
        throw py::value_error("an array has the wrong type or order");
    auto array = py::reinterpret_borrow<py::array_t<T>>(given);
    if (size_t(array.size()) != count) throw py::value_error("an array has the wrong shape");
    return array.mutable_data();
}

// Returns a value as a block of bytes. Arguments of the types kr_body and kr_scene accept such
// blocks.
template <class T> inline py::bytes block_of(const T &value)
{
    return py::bytes(reinterpret_cast<const char *>(&value), sizeof value);
}
namespace pybind11
{
namespace detail
{
template <class T> struct block_caster {
    PYBIND11_TYPE_CASTER(T, const_name("bytes"));
    bool load(handle block, bool)
    {
        if (!PyBytes_Check(block.ptr()) || PyBytes_GET_SIZE(block.ptr()) != sizeof(T)) return false;
        std::memcpy(&value, PyBytes_AS_STRING(block.ptr()), sizeof(T));
        return true;
    }
};
template <> struct type_caster<kr_body> : block_caster<kr_body> {
};
template <> struct type_caster<kr_scene> : block_caster<kr_scene> {
};
} // namespace detail
} // namespace pybind11
