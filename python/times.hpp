// Times and other numbers that need no further validation. Python validates all others and writes
// the error messages.
#pragma once
#include <cmath>
#include <cstring>
#include <vector>
#include "arrays.hpp"

// Returns true for a numpy double, as loops over numpy arrays yield it. Its base class is float,
// and it has no unit.
inline bool is_numpy_double(PyObject *given)
{
    return PyFloat_Check(given) && std::strcmp(Py_TYPE(given)->tp_name, "numpy.float64") == 0;
}
// Reads a float, an int or a numpy double as a double. Returns false for anything else, including
// other subclasses.
inline bool plain_number(PyObject *given, double &number)
{
    if (PyFloat_CheckExact(given) || is_numpy_double(given)) {
        number = PyFloat_AS_DOUBLE(given);
        return true;
    }
    if (!PyLong_CheckExact(given)) return false;
    number = PyLong_AsDouble(given);
    if (number != -1.0 || !PyErr_Occurred()) return true;
    PyErr_Clear();
    return false;
}

class given_times
{
    std::vector<double> own;
    const double *first = nullptr;
    size_t count = 0;

    void take_own()
    {
        first = own.data();
        count = own.size();
    }

  public:
    bool is_number = false;

    // Reads a number, a list or tuple of numbers, or an array of doubles, which must outlive this
    // object.
    bool take(const py::handle &t)
    {
        const auto *array_type = py::detail::npy_api::get().PyArray_Type_;
        // Masked arrays and arrays with units have other types.
        if (Py_TYPE(t.ptr()) == array_type && py::isinstance<doubles>(t)) {
            const auto array = py::reinterpret_borrow<doubles>(t);
            first = array.data();
            count = size_t(array.size());
            return array.ndim() == 1;
        }
        if (PyList_CheckExact(t.ptr()) || PyTuple_CheckExact(t.ptr())) {
            const auto items = py::reinterpret_steal<py::tuple>(PySequence_Tuple(t.ptr()));
            if (!items) throw py::error_already_set();
            own.resize(items.size());
            for (size_t i = 0; i < own.size(); i++)
                if (!plain_number(PyTuple_GET_ITEM(items.ptr(), py::ssize_t(i)), own[i]))
                    return false;
        } else {
            own.resize(1);
            is_number = true;
            if (!plain_number(t.ptr(), own[0])) return false;
        }
        take_own();
        return true;
    }
    // Inserts the time `begin` if the times are given by a single number.
    void begin_at(double begin)
    {
        if (!is_number) return;
        own.insert(own.begin(), begin);
        take_own();
    }
    bool are_below(double most) const
    {
        for (size_t i = 0; i < count; i++)
            if (!(std::fabs(first[i]) < most)) return false;
        return true;
    }
    // Returns true if all times lie on the same side of 0, in the order of their distances from 0.
    bool lead_away() const { return lead_from(0.0, end() < 0.0 ? -1.0 : 1.0); }
    // Returns true if the times, multiplied by `sign`, start at or after `last` and never decrease.
    bool lead_from(double last, double sign) const
    {
        for (size_t i = 0; i < count; last = sign * first[i++])
            if (!(sign * first[i] >= last)) return false;
        return true;
    }
    const double *data() const { return first; }
    size_t size() const { return count; }
    double end() const { return count ? first[count - 1] : 0.0; }
};
// Reads doubles from a tuple or list of numbers, or from an array of doubles. Returns false for
// anything else.
template <size_t n> inline bool numbers_of(const py::handle &given, double (&to)[n])
{
    given_times row;
    if (!row.take(given) || row.is_number || row.size() != n) return false;
    std::memcpy(to, row.data(), sizeof to);
    return true;
}
