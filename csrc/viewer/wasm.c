/* Functions that the viewer, a web page, calls in addition to those of kreisel.h: the simulation
 * (simulation.h), the meshes (mesh.h), and constants. This file is compiled only for WebAssembly.
 * The simulation is a global variable, because each page contains exactly one. */
#include <math.h>
#include <stddef.h>
#include "viewer/mesh.h"
#include "viewer/simulation.h"

/* EXPORT declares a function that only the viewer calls, and begins its definition. */
#define EXPORT(type, name, parameters)                                                             \
    KR_API type name parameters;                                                                   \
    KR_API type name parameters

/* The viewer accesses structs such as kr_body as arrays of doubles. PLACE checks at compile time
 * that a member has the expected index, and SIZE that a struct has the expected length. */
#define PLACE(type, part, place)                                                                   \
    typedef char place_of_##type##_##part[offsetof(type, part) == 8 * (place) ? 1 : -1]
#define SIZE(type, doubles) typedef char size_of_##type[sizeof(type) == 8 * (doubles) ? 1 : -1]
PLACE(kr_body, mass, 0);
PLACE(kr_body, inertia, 1);
PLACE(kr_body, com, 4);
PLACE(kr_body, axes, 7);
PLACE(kr_body, rounded, 11);
PLACE(kr_body, rotor, 12);
PLACE(kr_body, given, 15);
SIZE(kr_body, 30);
PLACE(kr_state, t, 0);
PLACE(kr_state, q, 1);
PLACE(kr_state, m, 5);
SIZE(kr_state, 8);
PLACE(kr_scene, body, 0);
PLACE(kr_scene, gravity, 30);
PLACE(kr_scene, start, 31);
PLACE(kr_scene, damping, 39);
PLACE(kr_scene, turning, 42);
PLACE(kr_scene, shaking, 45);
PLACE(kr_scene, friction, 48);
PLACE(kr_scene, wheels, 49);
PLACE(kr_scene, gradient, 61);
SIZE(kr_scene, 62);
PLACE(kr_box, half, 0);
PLACE(kr_box, centre, 3);
PLACE(kr_box, turn, 6);
PLACE(kr_box, density, 10);
SIZE(kr_box, 11);

static kr_simulation simulation;
static double measured[KR_SIMULATION_MEASURES];
static kr_vec3 velocity;
static double reach[2];
static kr_box box;
static double limits[6];
static float points[KR_MESH_RINGS * KR_MESH_SIDES][3];

/* Constants for the build of the viewer, and names of the kinds of bodies. */
EXPORT(int, kr_page_ticks, (void)) { return KR_SIMULATION_TICKS; }
EXPORT(int, kr_page_tops, (void)) { return KR_SIMULATION_TOPS; }
EXPORT(int, kr_page_way_points, (void)) { return KR_MESH_POINTS; }
EXPORT(int, kr_page_rod_rings, (void)) { return KR_MESH_RINGS; }
EXPORT(int, kr_page_rod_sides, (void)) { return KR_MESH_SIDES; }
EXPORT(const char *, kr_page_method_name, (const kr_method *method))
{
    return kr_method_describe(method).name;
}
EXPORT(const char *, kr_page_method_text, (const kr_method *method))
{
    return kr_method_describe(method).text;
}
EXPORT(int, kr_page_adaptive, (const kr_method *method))
{
    return (kr_method_describe(method).flags & KR_METHOD_ADAPTIVE) != 0;
}
EXPORT(int, kr_page_restarts, (const kr_method *method))
{
    return (kr_method_describe(method).flags & (KR_METHOD_ADAPTIVE | KR_METHOD_DENSE)) ==
           KR_METHOD_ADAPTIVE;
}
EXPORT(const char *, kr_page_kind, (const kr_body *body))
{
    return kr_kind_name(kr_body_kind(body, KR_KIND_RTOL));
}

/* Returns six numbers for a symmetric top (T: unit of time): least and greatest nutation angle
 * [rad], critical spin and mean rate of precession [T^-1], period of nutation [T], spin [T^-1].
 * An unknown rate or period or an infinite period is NaN. NULL if kr_exact_nutation fails. */
EXPORT(const double *, kr_page_limits, (const kr_scene *scene))
{
    kr_nutation nutation;
    if (kr_exact_nutation(scene, &nutation) != KR_OK) return NULL;
    static double memory[KR_EXACT_SIZE / sizeof(double)];
    kr_exact *exact = (kr_exact *)(void *)memory;
    const int known =
        kr_exact_size(scene) <= sizeof memory && kr_exact_plan(scene, 0.0, exact) == KR_OK;
    const kr_exact_info info = known ? kr_exact_describe(exact) : (kr_exact_info){0};
    limits[0] = nutation.least;
    limits[1] = nutation.greatest;
    limits[2] = nutation.critical_spin;
    limits[3] = known ? info.precession_rate : NAN;
    limits[4] = known && isfinite(info.period) ? info.period : NAN;
    kr_quantity_values(kr_quantity_find("spin"), scene, 1, &scene->start, &limits[5]);
    return limits;
}
EXPORT(const char *, kr_page_course, (const kr_scene *scene))
{
    kr_nutation nutation;
    return kr_exact_nutation(scene, &nutation) == KR_OK ? nutation.motion_type : "";
}

/* The simulation. */
EXPORT(void, kr_page_clear, (void)) { kr_simulation_clear(&simulation); }
EXPORT(kr_status, kr_page_add,
       (const kr_scene *scene, const kr_method *method, double step, double tol, int against))
{
    return kr_simulation_add(&simulation, scene, method, (int64_t)step, tol, against);
}
EXPORT(kr_status, kr_page_add_track,
       (const kr_scene *scene, const kr_state *track, int length, double step, int against))
{
    return kr_simulation_add_track(&simulation, scene, track, length, (int64_t)step, against);
}
EXPORT(void, kr_page_set_floor, (double lowest)) { kr_simulation_set_floor(&simulation, lowest); }
/* Returns the time at which the rim of top i touched the floor, or NaN. */
EXPORT(double, kr_page_stood, (int i)) { return simulation.slots[i].stood; }
EXPORT(double, kr_page_advance, (double target, int most))
{
    return (double)kr_simulation_advance(&simulation, (int64_t)target, most);
}
EXPORT(int, kr_page_late, (void)) { return simulation.is_late; }
EXPORT(double, kr_page_common, (void)) { return (double)simulation.common; }
EXPORT(const kr_state *, kr_page_state, (int i)) { return &simulation.slots[i].now; }
EXPORT(kr_status, kr_page_status, (int i)) { return simulation.slots[i].status; }
EXPORT(const kr_vec3 *, kr_page_velocity, (int i))
{
    velocity = kr_state_velocity(&simulation.slots[i].scene, &simulation.slots[i].now);
    return &velocity;
}

/* Measures and their record. */
EXPORT(int, kr_page_measures, (void)) { return KR_SIMULATION_MEASURES; }
EXPORT(const char *, kr_page_measure_name, (int k))
{
    const kr_quantity *quantity = kr_simulation_quantity(k);
    if (quantity) return quantity->name;
    return k == KR_SIMULATION_ERROR ? "error" : "modified_energy";
}
EXPORT(const char *, kr_page_measure_text, (int k))
{
    const kr_quantity *quantity = kr_simulation_quantity(k);
    if (quantity) return quantity->text;
    return k == KR_SIMULATION_ERROR
               ? "attitude error against another top, in radians"
               : "the energy that bobenko_suris keeps at its step, in its place";
}
EXPORT(int, kr_page_measure_kept, (int k))
{
    const kr_quantity *quantity = kr_simulation_quantity(k);
    return k == KR_SIMULATION_MODIFIED || (quantity && quantity->flags & KR_QUANTITY_CONSERVED);
}
EXPORT(const double *, kr_page_measure, (int i))
{
    kr_simulation_measure(&simulation, i, measured);
    return measured;
}
EXPORT(int, kr_page_rows, (void)) { return (int)simulation.rows; }
EXPORT(int, kr_page_row_doubles, (void)) { return sizeof(kr_record_row) / sizeof(double); }
EXPORT(const double *, kr_page_times, (void)) { return &simulation.record[0].time; }
/* Returns the address, in the first row of the record, of a measured value of top i or, if `side`
 * is -1 or 1, of its minimum or maximum (kr_record_row). Rows are kr_page_row_doubles apart. */
EXPORT(const double *, kr_page_record, (int i, int measure, int side))
{
    const kr_record_row *row = &simulation.record[0];
    return &(side < 0 ? row->low : side ? row->high : row->at)[i][measure];
}

/* The picture. */
EXPORT(const double *, kr_page_reach, (int i))
{
    kr_mesh_limits(&simulation.slots[i].scene, &reach[0], &reach[1]);
    return reach;
}
EXPORT(const kr_box *, kr_page_box, (const kr_body *body))
{
    box = kr_mesh_box(body);
    return &box;
}
static kr_trail make_trail(const kr_simulation_slot *a)
{
    return (kr_trail){a->attitudes, a->momenta, KR_SIMULATION_TRACE, a->steps,
                      (double)a->step / KR_SIMULATION_TICKS};
}
EXPORT(const float *, kr_page_points, (void)) { return points[0]; }
EXPORT(int, kr_page_way, (int i, double radius))
{
    const kr_trail t = make_trail(&simulation.slots[i]);
    return kr_mesh_trail(&simulation.slots[i].scene.body, &t, radius, points);
}
EXPORT(int, kr_page_momentum_way, (int i, double scale))
{
    const kr_trail t = make_trail(&simulation.slots[i]);
    return kr_mesh_momentum_trail(&t, scale, points);
}
EXPORT(int, kr_page_rod, (int i, double scale, double radius, double power))
{
    const kr_body *body = &simulation.slots[i].scene.body;
    const kr_trail t = make_trail(&simulation.slots[i]);
    return KR_MESH_SIDES * kr_mesh_rod(body, &t, scale, radius, power, points);
}
