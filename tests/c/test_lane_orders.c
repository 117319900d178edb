/* Order of the series in lanes and its error target, as functions of the tolerance: each row of
 * the table begins where the one before it ends. */
#include <math.h>
#include "check.h"
#include "ensemble/worker.h"

static void test_order(double log2_tol, int order, double aim)
{
    const kr_config config = {.tol = exp2(log2_tol)};
    kr_worker *worker = NULL;
    int chosen = 0;
    IS(kr_worker_create(kr_method_find("taylor"), config, 0, NULL, &worker) == KR_OK);
    IS(kr_worker_kernel(worker, &chosen) != NULL && chosen == order);
    NEAR(worker->lanes->log2_tol, aim, 1e-9);
    kr_worker_free(worker);
}
int main(void)
{
    test_order(-1.0, 12, -3.5);
    test_order(-18.0, 12, -20.5);
    test_order(-18.5, 14, -23.0);
    test_order(-26.0, 14, -30.5);
    test_order(-26.5, 16, -32.0);
    test_order(-32.0, 16, -37.5);
    test_order(-32.5, 18, -38.5);
    test_order(-48.0, 18, -54.0);
    test_order(-48.25, 20, -50.25);
    test_order(-52.0, 20, -54.0);
    /* The error target is at least 2^-54.5, unless the tolerance itself is below that. */
    test_order(-53.0, 20, -54.5);
    test_order(-60.0, 20, -60.0);
    return check_result();
}
