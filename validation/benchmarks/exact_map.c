/* The Bobenko-Suris map in 113-bit arithmetic, with the exact total twist
 * (csrc/methods/bobenko_suris.h).
 *
 * An input line has I1, I3, lever, step, q, m, the number of indices k, and the ascending indices.
 * The output has one line with q and m for each k. Needs gcc and libquadmath. */
#include <quadmath.h>
#include <stdio.h>

typedef __float128 quad;

static void step(quad q[4], quad m[3], quad i1, quad i3, quad lever, quad h)
{
    const quad a[3] = {2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]),
                       q[0] * q[0] + q[3] * q[3] - q[1] * q[1] - q[2] * q[2]};
    m[0] -= h * lever * a[1];
    m[1] += h * lever * a[0];
    const quad c = m[0] * a[0] + m[1] * a[1] + m[2] * a[2], f = h / (2 * i1);
    const quad x = f * m[0], y = f * m[1], z = f * m[2], half = h * c / (2 * i3) - atanq(f * c);
    const quad r[4] = {q[0] - x * q[1] - y * q[2] - z * q[3], q[1] + x * q[0] + y * q[3] - z * q[2],
                       q[2] - x * q[3] + y * q[0] + z * q[1],
                       q[3] + x * q[2] - y * q[1] + z * q[0]};
    const quad n = 1 / sqrtq(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]),
               C = n * cosq(half), S = n * sinq(half);
    q[0] = r[0] * C - r[3] * S;
    q[1] = r[1] * C + r[2] * S;
    q[2] = r[2] * C - r[1] * S;
    q[3] = r[3] * C + r[0] * S;
}
int main(void)
{
    double in[11];
    int n;
    for (;;) {
        for (int i = 0; i < 11; i++)
            if (scanf("%lf", &in[i]) != 1) return i != 0;
        if (scanf("%d", &n) != 1) return 1;
        quad q[4], m[3] = {in[8], in[9], in[10]}, norm = 0;
        for (int i = 0; i < 4; i++) norm += (quad)in[4 + i] * in[4 + i];
        for (int i = 0; i < 4; i++) q[i] = in[4 + i] / sqrtq(norm);
        for (long k = 0, goal; n > 0; n--) {
            if (scanf("%ld", &goal) != 1) return 1;
            for (; k < goal; k++) step(q, m, in[0], in[1], in[2], in[3]);
            for (int i = 0; i < 7; i++) {
                char text[64];
                quadmath_snprintf(text, sizeof text, "%.36Qg", i < 4 ? q[i] : m[i - 4]);
                printf("%s%c", text, i < 6 ? ' ' : '\n');
            }
        }
    }
}
