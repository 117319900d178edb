/* Functions that save a top to a block of memory (a checkpoint) and restore it. A checkpoint
 * contains no pointers. It consists of a header, the first SAVED_BYTES of kr_top (top.h), the work
 * arrays of its saved motions (kr_top.main and, without dense output, kr_top.saved), the tangents,
 * and a record of each event. A record holds the state of the search for the event, so that a
 * resumed run neither repeats nor misses an event. A restored top continues on the same time grid,
 * with the last step size and order. With dense output, it can still evaluate its last step. */
#include "top.h"

typedef struct checkpoint_header {
    char what[16], version[16], method[32];
    /* The number 0x0102030405060708, which reveals the byte order; SAVED_BYTES; the size of the
     * work array of one motion, in bytes; and the number of saved motions. */
    uint64_t layout[4];
    uint64_t sum; /* checksum of all bytes after the header */
} checkpoint_header;
typedef char header_has_no_gaps[sizeof(checkpoint_header) == 104 ? 1 : -1];
/* Number of bytes of a kr_top that are stored in a checkpoint. */
enum { SAVED_BYTES = offsetof(kr_top, body) + sizeof(body_dd) };

/* The record of an event: its search state, and a checksum of its definition. */
typedef struct event_record {
    kr_event_search own;
    uint64_t what;
} event_record;
typedef char saved_event_has_no_gaps[sizeof(event_record) == 40 ? 1 : -1];
typedef char term_has_no_gaps[sizeof(kr_term) == 16 ? 1 : -1];

static int count_saved_motions(const kr_top *top) { return top->method->at ? 1 : 2; }
static size_t work_bytes(const kr_top *top) { return top->method->work * sizeof(double); }
static size_t tangent_bytes(const kr_top *top)
{
    return kr_tangents_size(top->method, &top->config) * sizeof(double);
}

/* Returns the header of a checkpoint of `top`, with its checksum set to zero. */
static checkpoint_header make_header(const kr_top *top)
{
    checkpoint_header made = {.what = "kreisel top",
                              .version = KR_VERSION,
                              .layout = {0x0102030405060708, SAVED_BYTES, work_bytes(top),
                                         (uint64_t)count_saved_motions(top)}};
    memcpy(made.method, top->method->name, strlen(top->method->name));
    return made;
}
/* Returns a checksum of `size` bytes, a multiple of 8. Changing any single 64-bit word changes the
 * checksum, because no update maps two different sums or two different words to the same sum. */
static uint64_t checksum(const unsigned char *bytes, size_t size)
{
    uint64_t sum = 0xcbf29ce484222325, word;
    for (size_t i = 0; i + sizeof word <= size; i += sizeof word) {
        memcpy(&word, bytes + i, sizeof word);
        sum = (sum ^ word) * 0x100000001b3;
        sum ^= sum >> 29;
    }
    return sum;
}

static uint64_t checksum_event(const kr_event *event)
{
    const size_t term = sizeof(kr_term);
    const uint64_t parts[] = {
        checksum((const unsigned char *)event->terms, event->count * term),
        checksum((const unsigned char *)event->condition, event->condition_count * term),
        event->condition_count, event->extremum != 0, (uint64_t)(event->direction + 1)};
    return checksum((const unsigned char *)parts, sizeof parts);
}

/* Returns the size of a checkpoint in bytes, without the records of events. */
static size_t find_event_offset(const kr_top *top)
{
    return sizeof(checkpoint_header) + SAVED_BYTES +
           (size_t)count_saved_motions(top) * work_bytes(top) + tangent_bytes(top);
}
size_t kr_top_save_size(const kr_top *top)
{
    return top ? find_event_offset(top) + top->event_count * sizeof(event_record) : 0;
}
/* Copies the pointers of `from` to `to`, or sets them to NULL if `from` is NULL. */
static void copy_motion_pointers(kr_motion *to, const kr_motion *from)
{
    to->scene = from ? from->scene : NULL;
    to->body = from ? from->body : NULL;
    to->aux = from ? from->aux : NULL;
    to->work = from ? from->work : NULL;
}
kr_status kr_top_save(const kr_top *top, size_t size, void *memory)
{
    unsigned char *to = memory;
    kr_top image;
    if (!top || !memory || size != kr_top_save_size(top)) return KR_ERR_ARGUMENT;
    checkpoint_header head = make_header(top);
    unsigned char *work = to + sizeof head + SAVED_BYTES;
    memcpy(&image, top, SAVED_BYTES);
    image.method = NULL;
    image.config.poll = NULL;
    image.config.context = NULL;
    copy_motion_pointers(&image.main, NULL);
    copy_motion_pointers(&image.saved, NULL);
    copy_motion_pointers(&image.side, NULL);
    memcpy(to + sizeof head, &image, SAVED_BYTES);
    memcpy(work, top->main.work, work_bytes(top));
    if (count_saved_motions(top) > 1)
        memcpy(work + work_bytes(top), top->saved.work, work_bytes(top));
    if (top->tangents)
        memcpy(to + find_event_offset(top) - tangent_bytes(top), top->tangents, tangent_bytes(top));
    for (size_t i = 0; i < top->event_count; i++) {
        const event_record saved = {kr_event_load_search(&top->events[i]),
                                    checksum_event(&top->events[i])};
        memcpy(to + find_event_offset(top) + i * sizeof saved, &saved, sizeof saved);
    }
    head.sum = checksum(to + sizeof head, size - sizeof head);
    memcpy(to, &head, sizeof head);
    return KR_OK;
}

/* Returns 1 if two tops have the same scene, except for the initial state, and the same
 * configuration, except for max_steps, poll and context; else 0. */
static int has_same_setup(const kr_top *one, const kr_top *other)
{
    const kr_config *config = &one->config, *its = &other->config;
    const kr_scene *scene = &one->scene, *another = &other->scene;
    return memcmp(scene, another, offsetof(kr_scene, start)) == 0 &&
           memcmp(&scene->damping, &another->damping,
                  sizeof *scene - offsetof(kr_scene, damping)) == 0 &&
           config->step == its->step && config->tol == its->tol && config->digits == its->digits &&
           config->skip_heading == its->skip_heading && config->tangents == its->tangents;
}
/* Returns 1 if `motion`, from a checkpoint, has the digits, skip_heading and time direction of
 * `top`, and all counts, indices and loop bounds in `motion` and in its work array `work` are in
 * range; else 0. The checksum does not exclude invalid numbers, because it can be forged. */
static int is_valid_motion(const kr_top *top, const kr_motion *motion, const void *work)
{
    const kr_motion *own = &top->main;
    const kr_stats *stats = &motion->stats;
    const int64_t most = (int64_t)1 << 62;
    if (motion->digits != own->digits || motion->skip_heading != own->skip_heading) return 0;
    if (!(motion->step * top->forward >= 0.0)) return 0;
    if (stats->rejected < 0 || stats->evaluations < 0 || stats->iterations < 0) return 0;
    if (stats->rejected > most || stats->evaluations > most || stats->iterations > most) return 0;
    return !top->method->is_valid || top->method->is_valid(work);
}
/* Returns 1 if `top` can take over the data of `image`, a kr_top from a checkpoint, else 0. `work`
 * points to the work arrays of the saved motions in the checkpoint. */
static int is_valid_saved_top(const kr_top *top, const kr_top *image, const unsigned char *work)
{
    const int64_t most = (int64_t)1 << 53;
    if (image->forward != top->forward || kr_scene_check(&image->scene) != KR_OK) return 0;
    if (!(fabs(image->scene.start.t) < kr_top_horizon_of(top, &image->scene))) return 0;
    if (image->saved_steps < 0 || image->steps < image->saved_steps || image->steps > most)
        return 0;
    if (image->steps > image->saved_steps + KR_CHECK)
        return 0; /* a recovery repeats at most KR_CHECK steps */
    if (!is_valid_motion(top, &image->main, work)) return 0;
    return count_saved_motions(top) < 2 ||
           is_valid_motion(top, &image->saved, work + work_bytes(top));
}
/* Returns 1 if an event search state is valid for a top that has taken `steps` steps, else 0. */
static int is_valid_search(const kr_event_search *search, int64_t steps)
{
    return search->searched >= -1 && search->searched <= steps && search->mark >= 0.0 &&
           search->mark <= 2.0 && isfinite(search->next) && search->side >= -1 &&
           search->side <= 1 && search->sign >= -1 && search->sign <= 1;
}
/* Returns 1 if the event records at `from` belong to the events of `top`, in this order, and are
 * valid for a top after `steps` steps; else 0. Restores the searches if `restore` is nonzero. */
static int check_or_restore_events(kr_top *top, int64_t steps, const unsigned char *from,
                                   int restore)
{
    for (size_t i = 0; i < top->event_count; i++, from += sizeof(event_record)) {
        event_record saved;
        memcpy(&saved, from, sizeof saved);
        if (saved.what != checksum_event(&top->events[i]) || !is_valid_search(&saved.own, steps))
            return 0;
        if (restore) kr_event_store_search(&top->events[i], saved.own);
    }
    return 1;
}
kr_status kr_top_load(kr_top *top, size_t size, const void *memory)
{
    const unsigned char *from = memory;
    checkpoint_header head, own;
    kr_top image;
    if (!top || !memory) return KR_ERR_ARGUMENT;
    if (size != kr_top_save_size(top)) return KR_ERR_CHECKPOINT;
    const unsigned char *work = from + sizeof head + SAVED_BYTES;
    memcpy(&head, from, sizeof head);
    memcpy(&image, from + sizeof head, SAVED_BYTES);
    own = make_header(top);
    own.sum = checksum(from + sizeof head, size - sizeof head);
    if (memcmp(&head, &own, sizeof head) != 0 || !has_same_setup(&image, top))
        return KR_ERR_CHECKPOINT;
    if (!is_valid_saved_top(top, &image, work)) return KR_ERR_CHECKPOINT;
    if (!check_or_restore_events(top, image.steps, from + find_event_offset(top), 0))
        return KR_ERR_CHECKPOINT;
    /* Work arrays of variable size are not saved. A method that rejects a state changes none. */
    kr_motion motion = top->main;
    motion.scene = &image.scene;
    if (top->method->extra_doubles && top->method->reset(&motion, &image.scene.start) != KR_OK)
        return KR_ERR_CHECKPOINT;
    image.method = top->method;
    image.config = top->config;
    image.inspect_at = image.steps; /* so that a changed max_steps takes effect */
    copy_motion_pointers(&image.main, &top->main);
    copy_motion_pointers(&image.saved, &top->saved);
    copy_motion_pointers(&image.side, &top->side);
    memcpy(top, &image, SAVED_BYTES);
    top->horizon = kr_top_horizon_of(top, &top->scene);
    check_or_restore_events(top, image.steps, from + find_event_offset(top), 1);
    if (!top->method->extra_doubles) memcpy(top->main.work, work, work_bytes(top));
    if (count_saved_motions(top) > 1)
        memcpy(top->saved.work, work + work_bytes(top), work_bytes(top));
    if (top->tangents)
        memcpy(top->tangents, from + find_event_offset(top) - tangent_bytes(top),
               tangent_bytes(top));
    return KR_OK;
}
