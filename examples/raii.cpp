// A top in C++: the destructor of a std::unique_ptr frees it, and exceptions report errors.
#include <kreisel.h>
#include <cstdio>
#include <memory>
#include <stdexcept>

struct TopDeleter {
    void operator()(kr_top *top) const { kr_top_free(top); }
};
using Top = std::unique_ptr<kr_top, TopDeleter>;

void check(kr_status status)
{
    if (status != KR_OK) throw std::runtime_error(kr_status_text(status));
}
Top make_top(const kr_scene &scene, const kr_method &method, kr_config config)
{
    kr_top *top = nullptr;
    check(kr_top_create(&scene, &method, config, &top));
    return Top(top);
}

int main()
{
    const kr_scene scene = kr_scene_default();
    const Top top = make_top(scene, kr_method_taylor, kr_config_default());
    check(kr_top_advance(top.get(), 1.0));
    const kr_state s = kr_top_state(top.get());
    const double lost = kr_state_energy(&scene, &s) / kr_state_energy(&scene, &scene.start) - 1.0;
    std::printf("t = %g: tilt %.9f, lost energy %.0e\n", s.t, kr_state_nutation(&scene, &s), lost);
    try {
        make_top(scene, kr_method_strang, kr_config_default()); // a fixed-step method without step
    } catch (const std::runtime_error &error) {
        std::printf("caught: %s\n", error.what());
    }
}
