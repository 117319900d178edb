// Events: the table of components, and the values of event functions.
#include "events.hpp"

static doubles terms_value(const kr_scene &scene, const doubles &states, const py::list &list)
{
    if (states.ndim() != 2 || states.shape(1) != 8)
        throw py::value_error("an array has the wrong shape");
    const kr_state *in = reinterpret_cast<const kr_state *>(states.data());
    const terms g = terms_of(list);
    doubles out(states.shape(0));
    double *to = out.mutable_data();
    in_pieces(states.shape(0), [&](py::ssize_t i, py::ssize_t end) {
        for (; i < end; i++) to[i] = kr_terms_value(&scene, &in[i], g.size(), g.data());
    });
    return out;
}

static py::dict components()
{
    py::dict table("1"_a = int(KR_COMPONENT_ONE));
    for (size_t i = 0; kr_quantity_at(i); i++) {
        const kr_quantity *quantity = kr_quantity_at(i);
        for (size_t k = 0; quantity->flags & KR_QUANTITY_IN_EVENTS && k < quantity->doubles; k++) {
            const std::string name = std::string(quantity->name) + quantity->suffixes[k];
            table[name.c_str()] = kr_component_find(name.c_str());
        }
    }
    return table;
}

void bind_events(py::module_ &m);
void bind_events(py::module_ &m)
{
    m.attr("components") = components();
    m.def("terms_value", terms_value, "scene"_a, "states"_a, "terms"_a);
}
