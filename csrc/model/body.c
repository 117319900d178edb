/* The inertia J, the principal axes and the kind (integrable case) of a body with a fixed point.
 * `com` is the vector from this point to the centre of mass. A body is symmetric if two of its
 * principal moments of inertia are equal up to rounding errors, and spherical if all three are. A
 * rotor (kreisel.h) is axial if its momentum is along the symmetry axis; for a spherical body,
 * along com, or any axis if com = 0. Users describe a body in the frame of description, and
 * kr_body.axes rotates vectors from the principal axes into this frame. The principal axes are
 * computed by Jacobi's eigenvalue method, which is accurate even if principal moments coincide. */
#include "body.h"

/* Returns 1 if the principal moments i are positive, and none exceeds the sum of the other two by
 * more than a relative tolerance: the larger of `rounded` and KR_INPUT_RTOL (both: kreisel.h). */
static int are_moments_physical(kr_vec3 i, double rounded)
{
    const double one = 1.0 + fmax(rounded, KR_INPUT_RTOL);
    return i.x > 0.0 && i.y > 0.0 && i.z > 0.0 && i.x <= (i.y + i.z) * one &&
           i.y <= (i.z + i.x) * one && i.z <= (i.x + i.y) * one;
}
kr_status kr_body_check(const kr_body *b)
{
    if (!b || !isfinite(b->mass) || !(b->mass > 0.0) || !v_finite(b->com) || !v_finite(b->inertia))
        return KR_ERR_ARGUMENT;
    if (!v_finite(b->rotor)) return KR_ERR_ARGUMENT;
    if (!(fabs(q_dot(b->axes, b->axes) - 1.0) <= KR_INPUT_RTOL)) return KR_ERR_ARGUMENT;
    if (!(b->rounded >= 0.0 && b->rounded < 1.0)) return KR_ERR_ARGUMENT;
    return are_moments_physical(b->inertia, b->rounded) ? KR_OK : KR_ERR_BODY;
}
/* Returns 1 if some distribution of mass has the inertia J and the vector com, up to a tolerance.
 * The matrix of second moments is S = identity * (tr J) / 2 - J about the fixed point; about the
 * centre of mass, it is S - mass com com^t >= 0. If S > 0, this means mass <com, S^-1 com> <= 1. */
int kr_body_is_physical(const kr_body *b)
{
    const kr_vec3 i = b->inertia, c = b->com;
    const double slack = (1e-6 + b->rounded) * v_largest(i);
    const kr_vec3 s = v3(0.5 * (i.y + i.z - i.x) + slack, 0.5 * (i.z + i.x - i.y) + slack,
                         0.5 * (i.x + i.y - i.z) + slack);
    const double needed =
        b->mass * c.x * (c.x / s.x) + b->mass * c.y * (c.y / s.y) + b->mass * c.z * (c.z / s.z);
    return are_moments_physical(i, b->rounded) && !(needed > 1.0);
}
static kr_status check_and_copy_body(const kr_body *b, kr_body *out)
{
    const kr_status status = out ? kr_body_check(b) : KR_ERR_ARGUMENT;
    if (status == KR_OK) *out = *b;
    return status;
}
static int is_equal(double a, double b, double rtol)
{
    return fabs(a - b) <= rtol * fmax(fabs(a), fabs(b));
}
/* axis_cycles[i] is the rotation that permutes the axes cyclically and maps the third to axis i. */
static const kr_quat axis_cycles[3] = {
    {0.5, 0.5, 0.5, 0.5}, {0.5, -0.5, -0.5, -0.5}, {1.0, 0.0, 0.0, 0.0}};

/* Returns v with cyclically permuted components, so that component `last` becomes the third. */
static kr_vec3 permute_axes(kr_vec3 v, int last)
{
    return v3(component_at(v, (last + 1) % 3), component_at(v, (last + 2) % 3),
              component_at(v, last));
}
/* Returns the larger of the magnitudes of the two components of v other than component `axis`. */
static double largest_off_axis_component(kr_vec3 v, int axis)
{
    const kr_vec3 w = permute_axes(v, axis);
    return fmax(fabs(w.x), fabs(w.y));
}
/* Returns the index of the principal axis about which the inertia tensor is symmetric, or -1 if all
 * three moments differ by more than the relative tolerance rtol. For a spherical body, returns the
 * index of the principal axis that is nearest to the direction of the centre of mass. */
static int find_symmetry_axis(const kr_body *b, double rtol)
{
    int axis = -1;
    for (int i = 2; i >= 0; i--) {
        if (!is_equal(component_at(b->inertia, (i + 1) % 3), component_at(b->inertia, (i + 2) % 3),
                      rtol))
            continue;
        if (axis < 0 || fabs(component_at(b->com, i)) > fabs(component_at(b->com, axis))) axis = i;
    }
    return axis;
}
static int is_spherical(const kr_body *b)
{
    const kr_vec3 i = b->inertia;
    return is_equal(i.x, i.y, KR_KIND_RTOL) && is_equal(i.y, i.z, KR_KIND_RTOL);
}
static kr_kind find_kind_without_rotor(const kr_body *b, double rtol)
{
    const double reach = v_largest(b->com);
    const int axis = find_symmetry_axis(b, rtol);
    if (reach == 0.0) return KR_KIND_EULER;
    if (axis < 0) return KR_KIND_GENERAL;
    const kr_vec3 J = permute_axes(b->inertia, axis);
    if (largest_off_axis_component(b->com, axis) <= rtol * reach || is_equal(J.x, J.z, rtol))
        return KR_KIND_LAGRANGE;
    if (fabs(component_at(b->com, axis)) > rtol * reach) return KR_KIND_GENERAL;
    if (is_equal(J.x, 2.0 * J.z, rtol)) return KR_KIND_KOWALEWSKI;
    return is_equal(J.x, 4.0 * J.z, rtol) ? KR_KIND_GORYACHEV_CHAPLYGIN : KR_KIND_GENERAL;
}
int kr_body_is_rotor_axial(const kr_body *b, double rtol)
{
    const int axis = find_symmetry_axis(b, rtol);
    if (!kr_body_has_rotor(b)) return 1;
    if (axis < 0) return 0;
    if (is_spherical(b))
        return v_largest(b->com) == 0.0 ||
               v_largest(v_cross(v_unit(b->com), v_unit(b->rotor))) <= rtol;
    return largest_off_axis_component(b->rotor, axis) <= rtol * v_largest(b->rotor);
}
/* Returns the kind of a body. A rotor that is not axial turns KR_KIND_EULER into KR_KIND_GYROSTAT.
 * An axial rotor changes neither this kind nor KR_KIND_LAGRANGE: it only adds -h / I3 (momentum h,
 * moment I3 about the axis) to the spin. In all other cases, a rotor gives KR_KIND_GENERAL. */
kr_kind kr_body_kind(const kr_body *b, double rtol)
{
    const kr_kind kind = find_kind_without_rotor(b, rtol);
    if (!kr_body_has_rotor(b)) return kind;
    if (kind != KR_KIND_EULER && kind != KR_KIND_LAGRANGE) return KR_KIND_GENERAL;
    if (kr_body_is_rotor_axial(b, rtol)) return kind;
    return kind == KR_KIND_EULER ? KR_KIND_GYROSTAT : KR_KIND_GENERAL;
}

int kr_body_symmetry(const kr_body *b, double *across, double *along)
{
    const kr_vec3 i = b->inertia;
    const double reach = v_largest(b->com), largest = v_largest(i),
                 least = fmin(i.x, fmin(i.y, i.z));
    const int is_round = largest - least <= KR_KIND_RTOL * largest;
    int axis = 2, count = reach == 0.0;
    for (int k = 2; k >= 0 && reach > 0.0; k--)
        if (fabs(component_at(b->com, k)) > KR_KIND_RTOL * reach) axis = k, count++;
    const kr_vec3 J = permute_axes(i, axis);
    *across = is_round ? i.z : 0.5 * (J.x + J.y);
    *along = is_round ? i.z : J.z;
    return is_round || (count == 1 && fabs(J.x - J.y) <= KR_KIND_RTOL * largest);
}
int kr_body_last_axis(const kr_body *b)
{
    const kr_vec3 i = b->inertia;
    const int axis = find_symmetry_axis(b, KR_KIND_RTOL);
    if (axis >= 0) return axis;
    const int middle = (i.x < i.y) != (i.x < i.z) ? 0 : (i.y < i.x) != (i.y < i.z) ? 1 : 2;
    return (middle + 1) % 3;
}
/* Returns the working axes (body.h) of a spherical body, the third of them along third_axis, whose
 * components refer to the principal axes. Replaces the moments, which may differ by rounding
 * errors, by their mean. Requires equal components of `damping`. */
static kr_working choose_spherical_axes(const kr_body *b, kr_vec3 third_axis, kr_vec3 damping)
{
    const kr_vec3 i = b->inertia;
    const double mean = i.x + ((i.y - i.x) + (i.z - i.x)) / 3.0;
    const kr_quat axes = q_tilt(v_unit(third_axis));
    return (kr_working){.axes = axes,
                        .inertia = v3(mean, mean, mean),
                        .com = q_turn_back(axes, b->com),
                        .damping = damping,
                        .rotor = q_turn_back(axes, b->rotor),
                        .tilted = 1};
}
kr_working kr_body_principal(const kr_body *b, kr_vec3 damping)
{
    return (kr_working){q_one(), b->inertia, b->com, damping, b->rotor, 0};
}
/* Returns w, with w.rotor.x = w.rotor.y = 0 if the rotor of b is axial up to rounding errors. */
static kr_working zero_off_axis_rotor(kr_working w, const kr_body *b)
{
    if (kr_body_has_rotor(b) && kr_body_is_rotor_axial(b, KR_KIND_RTOL))
        w.rotor.x = w.rotor.y = 0.0;
    return w;
}
kr_working kr_body_working_damped(const kr_body *b, kr_vec3 damping)
{
    const int is_even = damping.x == damping.y && damping.y == damping.z;
    /* With equal damping about all axes, the third working axis (body.h) of a spherical body is
     * along com != 0 if the rotor is zero or parallel to com. Any other rotor gives the axis: rotor
     * or -rotor, with a component >= 0 along principal axis 3. Without both, it is this axis 3. */
    const int is_about_com = v_largest(b->com) > 0.0 && kr_body_is_rotor_axial(b, KR_KIND_RTOL);
    const kr_vec3 last_axis = is_about_com || !kr_body_has_rotor(b)
                                  ? b->com
                                  : v_scale(b->rotor.z < 0.0 ? -1.0 : 1.0, b->rotor);
    if (is_spherical(b) && v_largest(last_axis) > 0.0)
        return is_even ? zero_off_axis_rotor(choose_spherical_axes(b, last_axis, damping), b)
                       : kr_body_principal(b, damping);
    const int last = kr_body_last_axis(b);
    const kr_working w = {
        axis_cycles[last],           permute_axes(b->inertia, last), permute_axes(b->com, last),
        permute_axes(damping, last), permute_axes(b->rotor, last),   0};
    return zero_off_axis_rotor(w, b);
}
kr_working kr_body_working(const kr_body *b)
{
    return kr_body_working_damped(b, v3(0.0, 0.0, 0.0));
}

/* Rotates the axes p and p + 1 (modulo 3) so that the element a[p][p + 1] of the symmetric matrix a
 * becomes zero. Multiplies `axes` by the quaternion of this rotation from the right. */
static void apply_jacobi_rotation(double a[3][3], kr_quat *axes, int p)
{
    const int q = (p + 1) % 3, r = (p + 2) % 3;
    if (a[p][q] == 0.0) return;
    const double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    const double t = (theta < 0.0 ? -1.0 : 1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
    const double c = 1.0 / sqrt(t * t + 1.0), s = t * c, apq = a[p][q], apr = a[p][r],
                 aqr = a[q][r];
    const double half[3] = {r == 0 ? -s : 0.0, r == 1 ? -s : 0.0, r == 2 ? -s : 0.0};
    a[p][p] -= t * apq;
    a[q][q] += t * apq;
    a[p][q] = a[q][p] = 0.0;
    a[p][r] = a[r][p] = c * apr - s * aqr;
    a[q][r] = a[r][q] = s * apr + c * aqr;
    *axes = q_unit(q_mul(*axes, q4(1.0 + c, v3(half[0], half[1], half[2]))));
}

/* Returns the rotation by the smallest angle that maps the coordinate axes to q e1 q*, q e2 q* and
 * q e3 q* in any order and with any signs, where q = `axes`. */
static kr_quat reorder_axes_near_identity(kr_quat axes)
{
    static const double r = 0.70710678118654752;
    const kr_quat turns[6] = {q_one(),
                              q4(r, v3(r, 0, 0)),
                              q4(r, v3(0, r, 0)),
                              q4(r, v3(0, 0, r)),
                              q4(0.5, v3(0.5, 0.5, 0.5)),
                              q4(0.5, v3(-0.5, -0.5, -0.5))};
    const kr_quat half_turns[4] = {q_one(), q4(0, v3(1, 0, 0)), q4(0, v3(0, 1, 0)),
                                   q4(0, v3(0, 0, 1))};
    kr_quat best = axes;
    for (int i = 0; i < 24; i++) {
        const kr_quat q = q_mul(q_mul(axes, turns[i / 4]), half_turns[i % 4]);
        if (fabs(q.w) > fabs(best.w)) best = q;
    }
    return best.w < 0.0 ? q_scale(-1.0, best) : best;
}

/* Sets b->axes to `axes`, and sets the moments of inertia and the centre of mass of b along these
 * principal axes. `tensor` (stored by rows) and `com` are in the frame of description. */
static void set_axes(kr_body *b, kr_quat axes, const double tensor[9], kr_vec3 com)
{
    const double *j = tensor;
    double moments[3];
    for (int i = 0; i < 3; i++) {
        const kr_vec3 u = q_turn(axes, v_axis(i));
        moments[i] = v_dot(u, v3(v_dot(v_of(j), u), v_dot(v_of(j + 3), u), v_dot(v_of(j + 6), u)));
    }
    b->axes = axes;
    b->com = q_turn_back(axes, com);
    b->inertia = v_of(moments);
}
/* Returns 1 if the distance of the centre of mass from the principal axis with index `axis` may be
 * due to rounding errors of the inertia tensor. These errors rotate the axis by an angle inversely
 * proportional to the relative difference between the moment about this axis and the others. */
static int is_axis_through_com(const kr_body *b, int axis)
{
    const kr_vec3 J = permute_axes(b->inertia, axis);
    return largest_off_axis_component(b->com, axis) * (fabs(J.z - J.x) / fmax(J.z, J.x)) <=
           KR_KIND_RTOL * v_largest(b->com);
}
/* Returns principal axes of b: if no two moments are equal, b->axes; if all are, the frame of
 * description, in which `com` is given; else the axes nearest to it, except that a symmetry axis
 * through the centre of mass becomes the third one, along com or -com if com != 0. */
static kr_quat choose_principal_axes(const kr_body *b, kr_vec3 com)
{
    const int axis = find_symmetry_axis(b, KR_KIND_RTOL);
    const double reach = v_largest(com);
    if (axis < 0) return b->axes;
    if (is_spherical(b)) return q_one();
    kr_vec3 a = q_turn(b->axes, v_axis(axis));
    if (is_axis_through_com(b, axis)) {
        if (reach > 0.0) a = v_scale(1.0 / reach, com);
        return q_tilt(v_scale((a.z < 0.0 ? -1.0 : 1.0) / v_length(a), a));
    }
    const double x = fabs(a.x), y = fabs(a.y), z = fabs(a.z);
    const kr_quat cycle = axis_cycles[x > y && x > z ? 0 : y > z ? 1 : 2];
    const kr_vec3 along = q_turn_back(cycle, a);
    const kr_quat tilt = q_tilt(v_scale(along.z < 0.0 ? -1.0 : 1.0, along));
    return q_mul(q_mul(cycle, tilt), q_conj(cycle));
}
/* Makes principal moments equal if they differ only by rounding errors. Moves the centre of mass of
 * a Lagrange top exactly onto the symmetry axis, unless the body is spherical. */
static void make_symmetry_exact(kr_body *b)
{
    const int axis = find_symmetry_axis(b, KR_KIND_RTOL);
    const kr_vec3 a = b->com;
    if (axis < 0) return;
    const kr_vec3 J = permute_axes(b->inertia, axis);
    const double pair = 0.5 * (J.x + J.y), lone = is_spherical(b) ? pair : J.z;
    b->inertia = v3(axis == 0 ? lone : pair, axis == 1 ? lone : pair, axis == 2 ? lone : pair);
    if (kr_body_kind(b, KR_KIND_RTOL) == KR_KIND_LAGRANGE && lone != pair)
        b->com = v3(axis == 0 ? a.x : 0.0, axis == 1 ? a.y : 0.0, axis == 2 ? a.z : 0.0);
}

kr_status kr_body_from_tensor(double mass, const double inertia[9], kr_vec3 com, double rounded,
                              kr_body *out)
{
    kr_body b = {.mass = mass, .com = com, .axes = {1.0, 0.0, 0.0, 0.0}, .rounded = rounded};
    double a[9], d[3][3], size = 0.0;
    int exponent;
    if (!inertia) return KR_ERR_ARGUMENT;
    for (int i = 0; i < 9; i++)
        size = fmax(size, isfinite(inertia[i]) ? fabs(inertia[i]) : INFINITY);
    if (!(size < INFINITY)) return KR_ERR_ARGUMENT;
    frexp(size, &exponent);
    for (int i = 0; i < 9; i++) {
        const double element = inertia[i], mirrored = inertia[3 * (i % 3) + i / 3];
        if (fabs(element - mirrored) > KR_INPUT_RTOL * size) return KR_ERR_ARGUMENT;
        d[i / 3][i % 3] = a[i] = ldexp(0.5 * element + 0.5 * mirrored, -exponent);
    }
    b.inertia = v3(inertia[0], inertia[4], inertia[8]);
    if (a[1] != 0.0 || a[2] != 0.0 || a[5] != 0.0) {
        /* 16 sweeps suffice for a 3 x 3 matrix, because Jacobi's method converges quadratically. */
        for (int sweep = 0; sweep < 16; sweep++)
            for (int p = 0; p < 3; p++) apply_jacobi_rotation(d, &b.axes, p);
        set_axes(&b, reorder_axes_near_identity(b.axes), a, com);
        set_axes(&b, choose_principal_axes(&b, com), a, com);
        make_symmetry_exact(&b);
        const kr_vec3 J = b.inertia;
        if (fmin(J.x, fmin(J.y, J.z)) < KR_TENSOR_MIN_RATIO * v_largest(J)) return KR_ERR_BODY;
        memcpy(b.given.inertia, inertia, sizeof b.given.inertia);
        b.given.com = com;
        b.inertia = v3(ldexp(J.x, exponent), ldexp(J.y, exponent), ldexp(J.z, exponent));
    }
    return check_and_copy_body(&b, out);
}
void kr_body_set_rotor(kr_body *body, kr_vec3 rotor)
{
    const int is_turned = v_largest(q_vec(body->axes)) > 0.0;
    body->rotor = is_turned ? q_turn_back(body->axes, rotor) : rotor;
    body->given.rotor = rotor;
}
void kr_inertia_add_point(double inertia[9], double mass, kr_vec3 a)
{
    const double xx = mass * (a.x * a.x), yy = mass * (a.y * a.y), zz = mass * (a.z * a.z);
    const double xy = mass * (a.x * a.y), yz = mass * (a.y * a.z), zx = mass * (a.z * a.x);
    const double steiner[9] = {yy + zz, -xy, -zx, -xy, zz + xx, -yz, -zx, -yz, xx + yy};
    for (int i = 0; i < 9; i++) inertia[i] += steiner[i];
}
double kr_shape_mass(kr_shape shape, kr_vec3 s, double density)
{
    static const double pi = 3.14159265358979323846;
    if (shape == KR_SHAPE_CUBOID) return 8.0 * density * s.x * s.y * s.z;
    if (shape == KR_SHAPE_ELLIPSOID) return density * (4.0 / 3.0 * pi * s.x * s.y * s.z);
    if (shape == KR_SHAPE_TUBE) return density * (pi * (s.y - s.x) * (s.y + s.x) * s.z);
    return shape == KR_SHAPE_CONE ? density * (pi / 3.0 * s.x * s.x * s.y) : 0.0;
}
kr_vec3 kr_shape_inertia(kr_shape shape, kr_vec3 s, double mass, double *height)
{
    const kr_vec3 square = v_times(s, s);
    const double third = mass / 3.0, shell = square.x / 3.0, tube = (square.y + square.x) / 4.0;
    /* m: the integrals of x^2, y^2 and z^2 over the mass */
    kr_vec3 m = v_scale(mass, v3(shell, shell, shell));
    if (shape == KR_SHAPE_CUBOID) m = v3(third * s.x * s.x, third * s.y * s.y, third * s.z * s.z);
    if (shape == KR_SHAPE_ELLIPSOID) m = v_scale(mass, v_over(square, v3(5.0, 5.0, 5.0)));
    if (shape == KR_SHAPE_TUBE) m = v_scale(mass, v3(tube, tube, square.z / 12.0));
    if (shape == KR_SHAPE_CONE)
        m = v_scale(mass, v3(0.15 * s.x * s.x, 0.15 * s.x * s.x, 0.0375 * s.y * s.y));
    *height = shape == KR_SHAPE_CONE ? 0.75 * s.y : 0.0;
    return v3(m.y + m.z, m.z + m.x, m.x + m.y);
}
kr_status kr_body_shape(kr_shape shape, kr_vec3 s, double mass, kr_vec3 pivot, kr_body *out)
{
    double height;
    const kr_vec3 i = kr_shape_inertia(shape, s, mass, &height);
    const kr_vec3 com = v_sub(v3(0.0, 0.0, height), pivot);
    double j[9] = {i.x, 0.0, 0.0, 0.0, i.y, 0.0, 0.0, 0.0, i.z};
    if ((unsigned)shape > KR_SHAPE_CONE || !(s.x >= 0.0 && s.y >= 0.0 && s.z >= 0.0) ||
        (shape == KR_SHAPE_TUBE && s.x > s.y))
        return KR_ERR_ARGUMENT;
    kr_inertia_add_point(j, mass, com);
    return kr_body_from_tensor(mass, j, com, 0.0, out);
}
kr_status kr_body_symmetric(double mass, double i1, double i3, double height, kr_body *out)
{
    const kr_body b = {.mass = mass,
                       .inertia = {i1, i1, i3},
                       .com = {0.0, 0.0, height},
                       .axes = {1.0, 0.0, 0.0, 0.0}};
    return check_and_copy_body(&b, out);
}
