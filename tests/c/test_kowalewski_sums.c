/* Parts of the set-up of Kowalewski tops: roots, integrals, arrays that are full, and curves and
 * matrices that no sum fits. */
#ifdef __GNUC__
#  pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include "exact/kowalewski_plan.h"
#include "check.h"
#include "random.h"

static kowalewski_work work;
static kr_theta_sums plan;

static kowalewski_top random_top(double rate)
{
    const kr_vec3 w = random_vec(rate);
    kr_vec3 g = random_vec(1.0);
    kowalewski_top top;
    g = v_scale(1.0 / v_length(g), g);
    const double y[6] = {w.x, w.y, w.z, g.x, g.y, g.z};
    for (int i = 0; i < 6; i++) top.state[i] = dd_of(y[i]);
    top.l = dd_of(2.0 * (w.x * g.x + w.y * g.y) + w.z * g.z);
    return top;
}
static double miss(cx a, cx b) { return cx_abs(cx_sub(a, b)); }

/* The roots of phi add up to -h, and their differences are those of root_less_root. */
static void check_roots(const kowalewski_curve *o)
{
    const cx sum = cx_add(root_of(o, 0), cx_add(root_of(o, 1), root_of(o, 2)));
    const double size = 1.0 + fabs(o->h.hi) + o->k.hi;
    NEAR(miss(sum, cx_of(-o->h.hi, 0.0)), 0.0, 1e-14 * size);
    NEAR(root_of(o, ROOT_K).re + root_of(o, ROOT_MINUS_K).re, 0.0, 0.0);
    for (int i = 0; i < ROOTS; i++) {
        NEAR(base_of(o, i).hi, root_of(o, i).re, 0.0);
        NEAR(miss(cdd_high(root_dd(o, i)), root_of(o, i)), 0.0, 0.0);
        for (int j = 0; j < ROOTS; j++)
            NEAR(miss(root_less_root(o, i, j), cx_sub(root_of(o, i), root_of(o, j))), 0.0,
                 1e-14 * size);
    }
}
/* Kowalewski's variables of a state lie on the arcs of its curve. Those of another state do not if
 * F^2 is negative there. */
static void test_roots_and_arcs(void)
{
    int pairs = 0, outside[2] = {0, 0};
    for (int n = 0; n < 400; n++) {
        const kowalewski_top top = random_top(2.0), other = random_top(2.0);
        kowalewski_curve *o = &work.curve;
        if (analyse_curve(&top, &work) != KR_KOWALEWSKI_PLANNED) continue;
        pairs += o->pair;
        check_roots(o);
        IS(is_on_arcs(o, top.state));
        dd w[2];
        find_variables(o, other.state[0], other.state[1], w);
        for (int i = 0; i < 2; i++) {
            const double x = w[i].hi,
                         F2 = (o->k.hi - x) * (o->k.hi + x) * 2.0 * half_phi(o, w[i]).hi;
            if (F2 >= -1e-9 * pow(1.0 + fabs(x) + o->k.hi, 5.0) || (i == 0 && x > o->k.hi))
                continue;
            IS(!is_on_arcs(o, other.state));
            outside[i]++;
        }
    }
    IS(pairs > 20 && pairs < 380 && outside[0] > 0 && outside[1] > 0);
}
/* Complex roots to the right of both arcs do not count as near an arc. The arc of w1 ends at k. */
static void test_distant_pair(void)
{
    kowalewski_curve o = {.pair = 1, .real = 3, .order = {0, ROOT_MINUS_K, ROOT_K}};
    o.k = o.root[ROOT_K] = dd_of(1.0);
    o.root[ROOT_MINUS_K] = dd_of(-1.0);
    o.root[0] = dd_of(-2.0);
    o.root[2] = dd_of(1e-10);
    o.root[1] = dd_of(0.5);
    NEAR(separatrix_error(&o), distance_error(&o, 1, 2), 0.0);
    o.root[1] = dd_of(5.0);
    NEAR(separatrix_error(&o), distance_error(&o, 0, ROOT_MINUS_K), 0.0);
    const kowalewski_curve past = {.real = 3, .order = {ROOT_MINUS_K, ROOT_K, 0}};
    IS(!is_on_arcs(&past, random_top(1.0).state));
}
/* Integrals do not converge if two roots coincide at an end of their path or arc. */
static void test_coincident_roots(void)
{
    kowalewski_curve *o = &work.curve;
    const kowalewski_curve near = {.real = 5, .order = {ROOT_MINUS_K, 0, 1, 2, ROOT_K}};
    cx out[2];
    *o = near;
    o->settled = SETTLED;
    o->k = o->root[ROOT_K] = dd_of(1.0);
    o->root[ROOT_MINUS_K] = dd_of(-1.0);
    o->root[0] = dd_of(-1e-200);
    o->root[2] = dd_of(0.5);
    const kowalewski_path p = path_over_gap(o, 3);
    IS(integrate_path(&p, 0.0, out) && cx_abs(out[0]) == 0.0 && cx_abs(out[1]) == 0.0);
    IS(!integrate_path(&p, INFINITY, out));
    IS(!make_periods(o, work.arc, &work.rates, &work.theta.matrix));
    o->root[0] = dd_of(-0.5);
    o->root[1] = dd_of(0.5);
    make_arcs(o, work.arc);
    IS(!average_arcs(o, work.arc, &work.table, &work.samples, &work.rates));
}
/* An end of an even polynomial is restored from its neighbours. */
static void test_mended_ends(void)
{
    static samples v;
    for (int end = 0; end <= GRID; end += GRID) {
        for (int i = 0; i <= 4; i++) {
            const double x = 0.25 * i;
            v.v[2][end ? GRID - 64 * i : 64 * i] = dd_of(2.0 + x * x * (1.0 - 3.0 * x * x));
        }
        v.v[2][end] = dd_of(77.0);
        v.sum[2] = dd_of(0.0);
        mend_end(&v, end, 64);
        NEAR(v.v[2][end].hi, 2.0, 1e-15);
        NEAR(v.sum[2].hi, -37.5, 1e-15);
    }
}
/* Theta sums are refused if their arrays are full, or if B is wrong. */
static void test_full_arrays(void)
{
    const double none[2] = {0.0, 0.0};
    kowalewski_top top = random_top(0.7);
    theta_work *t = &work.theta;
    dual_work *d = &work.dual;
    dd heading;
    while (analyse_curve(&top, &work) != KR_KOWALEWSKI_PLANNED) top = random_top(0.7);
    IS(make_sums(&work, top.state, &plan, &heading) == KR_KOWALEWSKI_PLANNED);
    for (int sum = SUM_S; sum <= SUM_T; sum++) {
        int rows = SUM_ROWS, terms = 0;
        IS(!append_rows(&plan, t, sum, sum, 1.0, &rows, &terms) && rows == SUM_ROWS);
        rows = 0, terms = SUM_TERMS;
        IS(!append_rows(&plan, t, sum, sum, 1.0, &rows, &terms) && terms == SUM_TERMS);
    }
    IS(make_dual_sums(&work, top.state, &plan, &heading));
    for (int sum = SUM_S; sum < SUMS; sum++) {
        int rows = SUM_ROWS, terms = 0;
        IS(!append_dual_rows(&plan, t, d, sum, &rows, &terms) && rows == SUM_ROWS);
        rows = 0, terms = SUM_TERMS - 1;
        IS(append_dual_rows(&plan, t, d, sum, &rows, &terms) == 0 && terms >= SUM_TERMS - 1 &&
           terms <= SUM_TERMS);
    }
    kowalewski_matrix m = t->matrix;
    t->matrix.b12 += 0.3 * sqrt(m.b11 * m.b22);
    IS(!make_dual_sums(&work, top.state, &plan, &heading));
    IS(make_sums(&work, top.state, &plan, &heading) == KR_KOWALEWSKI_SUMS);
    t->matrix.b11 = t->matrix.b22 = 1e-3;
    t->matrix.b12 = 0.0;
    IS(!fill_sums(&plan, t));
    m.b11 = 10.0, m.b22 = 0.05, m.b12 = 0.0;
    IS(!list_terms(&m, t->kind, spinor_sums, none, &t->terms));
}
/* Dual sums whose growth factors or squares would overflow are refused. */
static void test_dual_overflow(void)
{
    static const double bend[4][3] = {
        {100.0, 10.0, 100.0}, {1000.0, 0.0, 1.0}, {1.0, 0.0, 1000.0}, {200.0, 0.0, 200.0}};
    dual_work *d = &work.dual;
    for (int i = 0; i < 4; i++) {
        d->count = 0;
        d->wide[0] = d->wide[1] = i < 3 ? 2 : 1;
        memcpy(d->bend, bend[i], sizeof d->bend);
        IS(scale_dual_terms(d) == (i == 0));
    }
}
/* Every sum of every kind has as many independent combinations as classes. */
static void test_combinations(void)
{
    static dual_basis b;
    for (int kind = 0; kind < KINDS; kind++)
        for (int sum = 0; sum < SUMS; sum++) {
            int classes = 0;
            for (int i = 0; i < CLASSES; i++) classes += has_class(kind, sum, i);
            make_basis(kind, sum, &b);
            IS(b.count == classes);
            for (int i = 0; i < b.count; i++)
                for (int j = 0; j <= i; j++) {
                    double dot = 0.0;
                    for (int k = 0; k < b.count; k++) dot += b.weight[i][k] * b.weight[j][k];
                    IS(i == j ? dot > 0.05 : fabs(dot) < 1e-12);
                }
        }
}
/* The distance of a term from the cell of the torus is the minimum over the cell, which a fine grid
 * in one coordinate approximates from above; the other coordinate has its best value. */
static void test_distance_to_cell(void)
{
    enum { POINTS = 4000 };
    for (int i = 0; i < 60; i++) {
        const double a = uniform(0.5, 1.5), c = uniform(0.5, 1.5),
                     b = sqrt(a * c) * uniform(-0.8, 0.8), k1 = uniform(-3.0, 3.0),
                     k2 = uniform(-3.0, 3.0);
        const double bend[3] = {a, b, c};
        double least = INFINITY;
        for (int j = 0; j <= POINTS; j++) {
            const double y = 2.0 * j / POINTS - 1.0 - k2,
                         x = fmax(-1.0, fmin(1.0, k1 - b / a * y)) - k1;
            least = fmin(least, a * x * x + c * y * y + 2.0 * b * x * y);
        }
        NEAR(distance_to_cell(bend, k1, k2), least, 1e-6);
    }
}
int main(void)
{
    test_roots_and_arcs();
    test_distant_pair();
    test_coincident_roots();
    test_mended_ends();
    test_full_arrays();
    test_dual_overflow();
    test_combinations();
    test_distance_to_cell();
    return check_result();
}
