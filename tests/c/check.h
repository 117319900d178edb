/* Assertions of the C tests: a failed assertion prints its line and its text, and NEAR also prints
 * the difference. main returns check_result(). */
#ifndef KR_CHECK_H
#define KR_CHECK_H
#include <math.h>
#include <stdio.h>

static int check_failures;

#define IS(cond)                                                                                   \
    do {                                                                                           \
        if (!(cond)) check_failures++, printf("%s:%d  not so: %s\n", __FILE__, __LINE__, #cond);   \
    } while (0)
#define NEAR(got, want, tol)                                                                       \
    do {                                                                                           \
        const double got_ = (got), want_ = (want), tol_ = (tol);                                   \
        if (!(fabs(got_ - want_) <= tol_)) {                                                       \
            check_failures++;                                                                      \
            printf("%s:%d  %s = %.17g, want %.17g within %.2g, off by %.2g\n", __FILE__, __LINE__, \
                   #got, got_, want_, tol_, got_ - want_);                                         \
        }                                                                                          \
    } while (0)

static inline int check_result(void)
{
    if (check_failures) printf("%d checks failed\n", check_failures);
    return check_failures != 0;
}
#endif
