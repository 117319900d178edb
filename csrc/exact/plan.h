/* What the set-ups of the closed form share. Floor 3.
 *     alpha = w + i z,  beta = x + i y,   x(t) = x0 + nu t,   nome exp(-pi K'/K)
 *     alpha ~ theta1(x + i y1) e^{i(c1 + k1 t)},  beta ~ theta2(x + i y2) e^{i(c2 + k2 t)},
 *     m_x + i m_y ~ theta3(x + i(y1 + y2)) e^{i(c1 + c2 + (k1 + k2) t)},  all over theta4(x)
 * (Klein and Sommerfeld, Theorie des Kreisels; Jacobi for the free top.) Whatever grows with time is computed in
 * double-double, so that no error does; q is made a unit quaternion, so theta4 is not needed. */
#ifndef KR_PLAN_H
#define KR_PLAN_H
#include "../body.h"
#include "../dd.h"

static inline double length(double x, double y) { return sqrt(x * x + y * y); }

/* A scene in working axes and own units, unrounded. */
typedef struct exact_top {
    kr_vec3 inertia;
    dd q[4], lever;             /* of any length; mass gravity com along T */
    kr_vec3 m;
    kr_quat axes;               /* working axes -> frame of description */
    kr_units units;
} exact_top;
kr_status kr_exact_read(const kr_scene *scene, kr_kind kind, exact_top *top);

kr_exact kr_exact_lagrange(const exact_top *top);
kr_exact kr_exact_euler(const exact_top *top);
kr_status kr_exact_own(const kr_scene *scene, exact_top *top, kr_exact *plan);  /* working axes, own units */
kr_state kr_exact_after(const kr_exact *plan, dd span);                 /* the state then, but for its t */
void kr_exact_factors(const kr_exact *plan, double span, double factors[6]);    /* alpha, beta, momentum; no unit q */

/* theta.c: elliptic means in double-double, theta series in double. */
enum theta { THETA1, THETA2, THETA3, THETA4 };
enum { CIRCULAR_COSINE, CIRCULAR_EVEN, HYPERBOLIC_COSINE, HYPERBOLIC_EVEN };    /* nome or its dual; shape of beta */
dd kr_elliptic_mean(dd kp, int n, const dd start[], dd sum[]);
double kr_elliptic_agm(double a, double b);
double kr_exact_stretch(kr_exact *plan, dd numerator, dd k2);
double kr_elliptic_rf(double x, double y, double z);
double kr_lone_root(double c2, double c1, double c0, int *top);
dd kr_polish(dd lead, const dd c[3], double start);
kr_theta kr_theta_series(enum theta which, double nome, double y, int dual);
double kr_theta_at(const double poly[KR_THETA_TERMS], double s);
void kr_theta_scale(kr_theta *series, double factor);

/* phase.c: phases, the frame around a plan, rates. */
kr_phase kr_phase_of(dd rate);                         /* [turns] of a rate in radians */
void kr_phase_start(kr_phase *phase, dd start);
dd kr_turns(double y, double x);
dd kr_turns_between(double x, double y, double u, double v);
dd kr_exact_axis(const dd q[4], dd a[3], dd *plus);      /* the third axis; 1 + a3 and, returned, 1 - a3 */
void kr_exact_back(const dd q[4], const dd v[3], dd r[3]);              /* q* v q / |q|^2 */
void kr_exact_steady(kr_exact *plan, kr_quat q, dd first, dd second);
void kr_exact_rates(kr_exact *plan, double nu, double first, double second, int euler);
exact_top kr_exact_from_below(const exact_top *top);
void kr_exact_turn_over(kr_exact *plan);
void kr_exact_to_user(kr_exact *plan, const exact_top *top, double start, double unit);
kr_quat kr_exact_rounded(const dd q[4]);
#endif
