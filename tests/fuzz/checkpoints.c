/* Checkpoints: a loaded top continues like the saved one, and damaged bytes are refused. */
#include <stdlib.h>
#include <string.h>
#include "random_values.h"
#include "claims.h"
#include "tops.h"

/* The last saved checkpoint, and its top. */
static struct {
    unsigned char *bytes;
    size_t size;
    kr_scene scene;
    kr_state start_low;
    const kr_method *method;
    kr_config config;
    int landed;
    search search;
} saved;

void discard_checkpoint(void)
{
    free(saved.bytes);
    saved.bytes = NULL;
}
void call_save(place *p)
{
    const size_t size = kr_top_save_size(p->top);
    discard_checkpoint();
    saved.bytes = malloc(size);
    begin_call(p);
    print_call("save");
    fill_with_mark(saved.bytes, size);
    CLAIM(kr_top_save(p->top, size - 1, saved.bytes) == KR_ERR_ARGUMENT);
    CLAIM(kr_top_save(p->top, size, NULL) == KR_ERR_ARGUMENT);
    CLAIM(is_marked(saved.bytes, size));
    const kr_status status = kr_top_save(p->top, size, saved.bytes);
    CLAIM(status == KR_OK);
    saved.size = size;
    saved.scene = p->scene;
    saved.start_low = p->start_low;
    saved.method = p->method;
    saved.config = p->config;
    saved.landed = p->landed;
    saved.search = p->search[p->watched];
    end_call(p, status);
}
static int are_terms_alike(const kr_term *one, const kr_term *other, size_t n)
{
    return n == 0 || same_bits(one, other, n * sizeof *one);
}
static int are_searches_alike(const search *one, const search *other)
{
    if (one->count != other->count) return 0;
    for (size_t i = 0; i < one->count; i++) {
        const kr_event *a = &one->event[i], *b = &other->event[i];
        if (a->count != b->count || a->condition_count != b->condition_count) return 0;
        if (a->extremum != b->extremum || a->direction != b->direction) return 0;
        if (!are_terms_alike(one->term[i], other->term[i], a->count)) return 0;
        if (!are_terms_alike(one->where[i], other->where[i], a->condition_count)) return 0;
    }
    return 1;
}
static int is_alike(const place *p)
{
    const kr_config *one = &p->config, *other = &saved.config;
    return p->method == saved.method &&
           same_bits(&p->scene.body, &saved.scene.body, sizeof(kr_body)) &&
           same_bits(&p->scene.damping, &saved.scene.damping, sizeof(kr_vec3)) &&
           same_bits(&p->scene.turning, &saved.scene.turning, sizeof(kr_vec3)) &&
           same_bits(&p->scene.shaking, &saved.scene.shaking, sizeof(kr_shaking)) &&
           p->scene.friction == saved.scene.friction && p->scene.gravity == saved.scene.gravity &&
           one->step == other->step && one->tol == other->tol && one->digits == other->digits &&
           one->skip_heading == other->skip_heading && one->tangents == other->tangents &&
           are_searches_alike(&p->search[p->watched], &saved.search);
}
void call_load(place *p)
{
    static unsigned char image[MOST_IMAGE], again[MOST_IMAGE];
    if (!saved.bytes) return;
    begin_call(p);
    save_image(p->top, image);
    print_call("load");
    const kr_status status = kr_top_load(p->top, saved.size, saved.bytes);
    CLAIM(status == (is_alike(p) ? KR_OK : KR_ERR_CHECKPOINT));
    if (status == KR_OK) {
        p->scene = saved.scene;
        p->start_low = saved.start_low;
        p->landed = saved.landed;
        p->was = kr_top_state(p->top);
        p->was_stats = kr_top_describe(p->top).stats;
    } else
        CLAIM(same_bits(image, again, save_image(p->top, again)));
    end_call(p, status);
}
void call_damage(place *p)
{
    const size_t size = kr_top_save_size(p->top);
    size_t shown = size;
    unsigned char *bytes = malloc(size);
    begin_call(p);
    p->imaged = 1;
    save_image(p->top, p->was_image);
    memcpy(bytes, p->was_image, size);
    const size_t at = (size_t)choose(size);
    if (odds(80))
        bytes[at] ^= (unsigned char)(1 + choose(255));
    else if (odds(50))
        shown = at;
    else
        for (size_t i = at & ~(size_t)7; i < size; i++) bytes[i] = (unsigned char)choose(256);
    print_call("load what is damaged, %zu of %zu bytes, at %zu", shown, size, at);
    unsigned char *exactly =
        malloc(shown + 1); /* at an odd address, and without room behind it, so that a sanitizer
                            * detects reads beyond the end */
    memcpy(exactly + 1, bytes, shown);
    const kr_status status = kr_top_load(p->top, shown, exactly + 1);
    CLAIM(status == KR_ERR_CHECKPOINT || same_bits(bytes, p->was_image, size));
    free(exactly);
    free(bytes);
    end_call(p, status);
}
/* Corrects the checksum of a checkpoint, as checkpoint.c computes it. */
static void put_sum(unsigned char *bytes, size_t size)
{
    enum { SUM = 96, SUMMED = 104 };
    uint64_t sum = 0xcbf29ce484222325, word;
    for (size_t i = SUMMED; i + sizeof word <= size; i += sizeof word) {
        memcpy(&word, bytes + i, sizeof word);
        sum = (sum ^ word) * 0x100000001b3;
        sum ^= sum >> 29;
    }
    memcpy(bytes + SUM, &sum, sizeof sum);
}
/* Changes some words after the header, and corrects the checksum. */
static void forge(unsigned char *bytes, size_t size)
{
    enum { SUMMED = 104 };
    for (int i = 1 + (int)choose(3); i > 0; i--) {
        const size_t at = SUMMED + (size_t)choose((size - SUMMED) / 4) * 4;
        const double number = any_double();
        const int32_t whole = odds(50) ? (int32_t)choose(64) - 16 : (int32_t)choose(UINT32_MAX);
        if (odds(50) && at + sizeof number <= size)
            memcpy(bytes + at, &number, sizeof number);
        else
            memcpy(bytes + at, &whole, sizeof whole);
    }
    put_sum(bytes, size);
}
/* A forged checkpoint is refused, or gives a valid top. This top may have any state, but its calls
 * end and do not read memory outside its own. */
void call_forge(place *p)
{
    static unsigned char bytes[MOST_IMAGE];
    double t[2] = {any_time(p), any_time(p)};
    kr_state out[2];
    kr_event_hit hit;
    begin_call(p);
    const size_t size = save_image(p->top, bytes);
    forge(bytes, size);
    print_call("load what is forged");
    p->imaged = 1;
    save_image(p->top, p->was_image);
    const kr_status status = kr_top_load(p->top, size, bytes);
    CLAIM(status == KR_OK || status == KR_ERR_CHECKPOINT);
    if (status != KR_OK) {
        end_call(p, status);
        return;
    }
    p->forged = 1;
    error_category(kr_top_advance(p->top, t[0]));
    error_category(kr_top_step(p->top));
    error_category(kr_top_seek(p->top, t[1], &hit));
    error_category(kr_top_record(p->top, 2, t, out, NULL, NULL));
    CLAIM(p->polls <= p->patience + 4);
    kr_top_free(p->top);
    p->top = NULL;
}
/* Advances to t. Writes the state that was reached, and returns the status. */
static kr_status go(kr_top *top, double t, kr_state *state)
{
    const kr_status status = kr_top_advance(top, t);
    *state = kr_top_state(top);
    return status;
}
void call_repeat(place *p)
{
    static unsigned char image[MOST_IMAGE];
    kr_state first, second, third;
    const double t = any_time(p);
    begin_call(p);
    p->imaged = 0; /* loading changes the times of polls */
    const size_t size = save_image(p->top, image);
    print_call("advance to %a, and again from a checkpoint", t);
    const kr_status status = go(p->top, t, &first);
    const int stopped = status == KR_ERR_INTERRUPTED || status == KR_ERR_LIMIT;
    /* After a reset an event may exceed the range of doubles, so that a new top cannot watch for
     * it. */
    kr_top *other = make_alike(p, p->config.tangents);
    search watched = p->search[p->watched];
    if (!stopped && kr_top_watch(other, watched.count, watched.event) == KR_OK) {
        CLAIM(kr_top_load(other, size, image) == KR_OK);
        CLAIM(go(other, t, &second) == status);
        CLAIM(same_bits(&first, &second, sizeof first));
    }
    const int polls = p->polls;
    const int more = stopped ? 0 : 1000; /* a run that ended needs few polls to end again */
    p->patience += more;
    CLAIM(kr_top_load(p->top, size, image) == KR_OK);
    const kr_status once_more = go(p->top, t, &third);
    p->patience -= more;
    if (!stopped) {
        CLAIM(once_more == status);
        CLAIM(same_bits(&first, &third, sizeof first));
    }
    p->polls = once_more == KR_ERR_INTERRUPTED ? p->patience : polls < p->patience ? polls : 0;
    if (once_more == KR_OK) p->landed = 1;
    end_call(p, once_more);
}
