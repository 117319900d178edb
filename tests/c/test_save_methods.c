/* Checkpoints of another method with the same size are refused. */
#include "tops.h"

enum { MOST = 1 << 16 };

static void test_checkpoint_of_another_method(void)
{
    static unsigned char saved[MOST];
    const kr_scene s = tilted();
    for (size_t i = 0; i < kr_method_count(); i++)
        for (size_t k = 0; k < kr_method_count(); k++) {
            const kr_method *its = kr_method_at(i), *other = kr_method_at(k);
            const kr_config config = {.step = 0.0625};
            if (!kr_method_suits(its, &s) || !kr_method_suits(other, &s)) continue;
            kr_top *top = make(&s, its, config), *to = make(&s, other, config);
            IS(kr_top_advance(top, 0.3) == KR_OK && kr_top_save_size(top) <= MOST);
            IS(kr_top_save(top, kr_top_save_size(top), saved) == KR_OK);
            IS(kr_top_load(to, kr_top_save_size(top), saved) ==
               (i == k ? KR_OK : KR_ERR_CHECKPOINT));
            kr_top_free(top);
            kr_top_free(to);
        }
}
int main(void)
{
    test_checkpoint_of_another_method();
    return check_result();
}
