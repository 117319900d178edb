/* Checkpoints: a top as bytes, and back. All that it is goes along - both its runs with
 * all their work, clocks, counts, own units - but for pointers, which the top that is loaded has of
 * its own. So a fixed-step run goes on on its grid, an adaptive one with the step and order that it
 * was about to take, a dense one inside its piece. */
#include "top.h"

typedef struct {
    char kind[16], version[16], method[32];
    /* a number that other machines write otherwise; sizes of the parts */
    uint64_t layout[4];
    uint64_t sum; /* of the parts */
} label;

/* A top up to its last state; what may follow there is the user's memory, and not kept. */
enum { KEPT = offsetof(kr_top, low) + sizeof(kr_state) };

static int runs(const kr_top *top) { return top->method->at ? 1 : 2; }
static size_t work_size(const kr_top *top) { return top->method->work * sizeof(double); }

static void put_name(char *to, size_t size, const char *name)
{
    for (size_t i = 0; i + 1 < size && name[i]; i++) to[i] = name[i];
}
static label label_of(const kr_top *top)
{
    label l = {.layout = {0x0102030405060708, KEPT, work_size(top), (uint64_t)runs(top)}};
    put_name(l.kind, sizeof l.kind, "kreisel top");
    put_name(l.version, sizeof l.version, kr_version());
    put_name(l.method, sizeof l.method, top->method->name);
    return l;
}
/* Each word is mixed in by a map that loses nothing: no change of a single one goes unseen. */
static uint64_t sum_of(const unsigned char *bytes, size_t size)
{
    uint64_t sum = 0xcbf29ce484222325, word;
    for (size_t i = 0; i + sizeof word <= size; i += sizeof word) {
        memcpy(&word, bytes + i, sizeof word);
        sum = (sum ^ word) * 0x100000001b3;
        sum ^= sum >> 29;
    }
    return sum;
}

size_t kr_top_save_size(const kr_top *top)
{
    return top ? sizeof(label) + KEPT + (size_t)runs(top) * work_size(top) : 0;
}
static void take_pointers(kr_motion *motion, const kr_motion *from)
{
    motion->scene = from ? from->scene : NULL;
    motion->aux = from ? from->aux : NULL;
    motion->work = from ? from->work : NULL;
}
kr_status kr_top_save(const kr_top *top, size_t size, void *memory)
{
    unsigned char *to = memory;
    kr_top image;
    if (!top || !memory || size != kr_top_save_size(top)) return KR_ERR_ARGUMENT;
    label l = label_of(top);
    unsigned char *work = to + sizeof l + KEPT;
    memcpy(&image, top, KEPT);
    image.method = NULL;
    image.config.poll = NULL;
    image.config.context = NULL;
    take_pointers(&image.main, NULL);
    take_pointers(&image.kept, NULL);
    take_pointers(&image.side, NULL);
    memcpy(to + sizeof l, &image, KEPT);
    memcpy(work, top->main.work, work_size(top));
    if (runs(top) > 1) memcpy(work + work_size(top), top->kept.work, work_size(top));
    l.sum = sum_of(to + sizeof l, size - sizeof l);
    memcpy(to, &l, sizeof l);
    return KR_OK;
}

static int same_kind(const kr_top *a, const kr_top *b)
{
    const kr_config *c = &a->config, *d = &b->config;
    return memcmp(&a->scene, &b->scene, offsetof(kr_scene, start)) == 0 && c->step == d->step &&
           c->tol == d->tol && c->digits == d->digits && c->leave_heading == d->leave_heading;
}
kr_status kr_top_load(kr_top *top, size_t size, const void *memory)
{
    const unsigned char *from = memory;
    label l, own;
    kr_top image;
    if (!top || !memory) return KR_ERR_ARGUMENT;
    if (size != kr_top_save_size(top)) return KR_ERR_CHECKPOINT;
    const unsigned char *work = from + sizeof l + KEPT;
    memcpy(&l, from, sizeof l);
    memcpy(&image, from + sizeof l, KEPT);
    own = label_of(top);
    own.sum = sum_of(from + sizeof l, size - sizeof l);
    if (memcmp(&l, &own, sizeof l) != 0 || !same_kind(&image, top)) return KR_ERR_CHECKPOINT;
    image.method = top->method;
    image.config = top->config;
    image.look_at = image.k; /* max_steps may be another */
    take_pointers(&image.main, &top->main);
    take_pointers(&image.kept, &top->kept);
    take_pointers(&image.side, &top->side);
    memcpy(top, &image, KEPT);
    for (size_t i = 0; i < top->watched; i++) top->events[i].piece = -1;
    memcpy(top->main.work, work, work_size(top));
    if (runs(top) > 1) memcpy(top->kept.work, work + work_size(top), work_size(top));
    return KR_OK;
}
