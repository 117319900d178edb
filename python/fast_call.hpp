// Methods of classes that Python calls without the overload resolution of pybind11.
#pragma once
#include <pybind11/pybind11.h>
#include <new>
namespace py = pybind11;

// Returns the C++ object of an instance of a class without base classes.
template <class T> inline T &instance_of(PyObject *self)
{
    auto *found = reinterpret_cast<py::detail::instance *>(self);
    void *value = found->get_value_and_holder().value_ptr();
    if (!value) throw py::type_error("this object was not constructed");
    return *static_cast<T *>(value);
}
// Returns the result of a function as a new reference, or sets the exception that it throws.
template <class Function> inline PyObject *guarded(Function function)
{
    try {
        return function().release().ptr();
    } catch (py::error_already_set &error) {
        error.restore();
    } catch (const py::builtin_exception &error) {
        error.set_error();
    } catch (const std::bad_alloc &) {
        PyErr_NoMemory();
    } catch (const std::exception &error) {
        PyErr_SetString(PyExc_RuntimeError, error.what());
    }
    return nullptr;
}
using fast_function = PyObject *(*)(PyObject * self, PyObject *const *given, Py_ssize_t n);
inline PyMethodDef fast_method(const char *name, fast_function function, const char *text)
{
    auto *any = reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(function));
    return {name, any, METH_FASTCALL, text};
}
// Adds a method to a class. The method must outlive the class.
template <class T> inline void add_method(py::class_<T> &type, PyMethodDef &method)
{
    auto *made = PyDescr_NewMethod(reinterpret_cast<PyTypeObject *>(type.ptr()), &method);
    if (!made) throw py::error_already_set();
    type.attr(method.ml_name) = py::reinterpret_steal<py::object>(made);
}
