// Paths of single tops. They are made from the results of the core without calls of Python code.
#pragma once
#include <vector>
#include "arrays.hpp"

// The shape of the values of a quantity at one state.
inline std::vector<py::ssize_t> shape_of(const kr_quantity *quantity)
{
    const auto width = py::ssize_t(quantity->doubles);
    if (width == 1) return {};
    if (width == 9) return {3, 3};
    return {width};
}
// Returns a new array. This takes less time than the constructor of pybind11.
inline doubles new_array(int dimensions, const py::ssize_t *shape)
{
    const auto &numpy = py::detail::npy_api::get();
    PyObject *type = numpy.PyArray_DescrFromType_(py::detail::npy_api::NPY_DOUBLE_);
    PyObject *made = numpy.PyArray_NewFromDescr_(numpy.PyArray_Type_, type, dimensions, shape,
                                                 nullptr, nullptr, 0, nullptr);
    if (!made) throw py::error_already_set();
    return py::reinterpret_steal<doubles>(made);
}
inline doubles new_states(size_t n)
{
    const py::ssize_t shape[] = {py::ssize_t(n), 8};
    return new_array(2, shape);
}
inline void make_read_only(const py::handle &array)
{
    py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
}

// Sets an attribute even if the class refuses assignments.
inline void set(const py::handle &object, const py::handle &name, const py::handle &value)
{
    if (PyObject_GenericSetAttr(object.ptr(), name.ptr(), value.ptr()) != 0)
        throw py::error_already_set();
}
inline py::object get(const py::handle &object, const py::handle &name)
{
    auto found = py::reinterpret_steal<py::object>(PyObject_GetAttr(object.ptr(), name.ptr()));
    if (!found) throw py::error_already_set();
    return found;
}

// Returns an instance of a class whose constructor is not called.
inline py::object instantiate(const py::handle &type)
{
    auto *of = reinterpret_cast<PyTypeObject *>(type.ptr());
    auto made = py::reinterpret_steal<py::object>(of->tp_new(of, py::tuple().ptr(), nullptr));
    if (!made) throw py::error_already_set();
    return made;
}
// Returns an instance of a class that is derived from tuple.
template <class... Items>
inline py::object instantiate_tuple(const py::handle &type, Items... items)
{
    auto *of = reinterpret_cast<PyTypeObject *>(type.ptr());
    auto made = py::reinterpret_steal<py::object>(of->tp_alloc(of, sizeof...(items)));
    if (!made) throw py::error_already_set();
    py::ssize_t i = 0;
    (PyTuple_SET_ITEM(made.ptr(), i++, items.release().ptr()), ...);
    return made;
}

// Makes instances of kreisel.Path. Attributes with the default of the class are not set.
class path_maker
{
    struct column {
        py::object name;
        const kr_quantity *quantity; // NULL: the times
        bool is_state;               // a part of the state, which a path reads from `_columns`
    };
    py::object path, stats, options;
    std::vector<column> columns;

    py::object values(const column &wanted, const kr_scene &scene, const doubles &states) const
    {
        const auto n = states.shape(0);
        auto shape = wanted.quantity ? shape_of(wanted.quantity) : std::vector<py::ssize_t>();
        shape.insert(shape.begin(), n);
        doubles out = new_array(int(shape.size()), shape.data());
        const auto *in = reinterpret_cast<const kr_state *>(states.data());
        double *to = out.mutable_data();
        if (wanted.quantity) {
            const auto width = py::ssize_t(wanted.quantity->doubles);
            in_pieces(n, [&](py::ssize_t i, py::ssize_t end) {
                kr_quantity_values(wanted.quantity, &scene, size_t(end - i), in + i,
                                   to + width * i);
            });
        } else {
            for (py::ssize_t i = 0; i < n; i++) to[i] = in[i].t;
        }
        make_read_only(out);
        return out;
    }

  public:
    // The names of attributes, which Python keeps for ever.
    struct names {
        py::str scene = intern("scene"), states = intern("states"), stats = intern("stats"),
                options = intern("_options"), is_back = intern("_is_back"), low = intern("_low"),
                columns = intern("_columns"), block = intern("_block"),
                horizon = intern("_resolvable_horizon"), origin = intern("_origin"),
                t = intern("t"), is_fresh = intern("_fresh"), motion = intern("_top");
        static py::str intern(const char *name)
        {
            return py::reinterpret_steal<py::str>(PyUnicode_InternFromString(name));
        }
    };
    names name;

    // `path` and `stats` are classes, `options` the options that a path stores, and `want` names of
    // quantities or None.
    path_maker(py::object path, py::object stats, py::object options, const py::object &want)
        : path(std::move(path)), stats(std::move(stats)), options(std::move(options))
    {
        if (want.is_none()) return;
        columns.push_back({names::intern("t"), nullptr, true});
        for (const py::handle &each : want) {
            const auto text = each.cast<std::string>();
            columns.push_back({names::intern(text.c_str()), kr_quantity_find(text.c_str()),
                               text == "q" || text == "m"});
        }
    }
    // Returns true if all wanted quantities are functions of the state.
    bool knows_columns() const
    {
        for (size_t i = 1; i < columns.size(); i++)
            if (!columns[i].quantity) return false;
        return true;
    }
    py::object stats_of(const kr_stats &s) const
    {
        return instantiate_tuple(stats, py::int_(s.steps), py::int_(s.rejected),
                                 py::int_(s.evaluations), py::int_(s.iterations));
    }
    // Returns a path of the states, or of the wanted quantities. `low` can be None.
    py::object make(const py::handle &scene, const doubles &states, const py::handle &low,
                    const py::handle &counts, bool is_back) const
    {
        py::object made = instantiate(path);
        set(made, name.scene, scene);
        set(made, name.stats, counts);
        set(made, name.options, options);
        if (is_back) set(made, name.is_back, py::bool_(true));
        if (!columns.empty()) {
            set_columns(made, get(scene, name.block).cast<kr_scene>(), states);
            return made;
        }
        make_read_only(states);
        set(made, name.states, states);
        if (!low.is_none()) {
            make_read_only(low);
            set(made, name.low, low);
        }
        return made;
    }

  private:
    void set_columns(const py::object &made, const kr_scene &block, const doubles &states) const
    {
        py::dict all;
        for (const column &each : columns) {
            const py::object array = values(each, block, states);
            all[each.name] = array;
            if (!each.is_state) set(made, each.name, array);
        }
        set(made, name.columns, all);
    }
};

// Makes copies of instances of kreisel.Scene with another start.
class scene_maker
{
    py::object type;
    std::vector<py::object> kept; // names of the fields that do not change
    py::object momentum = path_maker::names::intern("momentum"),
               attitude = path_maker::names::intern("attitude"),
               block = path_maker::names::intern("_block");

  public:
    explicit scene_maker(py::object scene) : type(std::move(scene))
    {
        for (const auto &[name, field] : py::dict(type.attr("__dataclass_fields__")))
            if (!name.equal(momentum) && !name.equal(attitude) && !name.equal(block))
                kept.push_back(py::reinterpret_borrow<py::object>(name));
    }
    // Returns true if `scene` is an instance of the class itself.
    bool makes(const py::handle &scene) const { return py::type::handle_of(scene).is(type); }
    py::object make(const py::handle &scene, const kr_scene &changed) const
    {
        const kr_quat q = changed.start.q;
        const kr_vec3 m = changed.start.m;
        py::object made = instantiate(type);
        for (const auto &name : kept) set(made, name, get(scene, name));
        set(made, momentum, py::make_tuple(m.x, m.y, m.z));
        set(made, attitude, py::make_tuple(q.w, q.x, q.y, q.z));
        set(made, block, block_of(changed));
        return made;
    }
};
