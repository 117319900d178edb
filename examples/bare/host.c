/* Runs bare.c on a PC, for one second. */
#include <stdio.h>
#include "bare.h"

int main(void)
{
    kr_status status = begin(0.001);
    for (int i = 1; i <= 1000 && status == KR_OK; i++) {
        status = tick();
        if (i % 250 == 0) printf("t = %.2f: height %.6f\n", i / 1000.0, height());
    }
    printf("%s, %u bytes of memory\n", kr_status_text(status), (unsigned)memory_used());
    return status != KR_OK;
}
