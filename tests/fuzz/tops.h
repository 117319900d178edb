/* The few tops of a round, and the data that the round stores for each. */
#ifndef KR_FUZZ_TOPS_H
#define KR_FUZZ_TOPS_H
#include "kreisel.h"

enum { SEARCHES = 3, TERMS = 3, MOST_IMAGE = 1 << 20 };
typedef struct search {
    kr_event event[SEARCHES];
    kr_term term[SEARCHES][TERMS], where[SEARCHES][TERMS];
    size_t count;
} search;
typedef struct place {
    kr_top *top;
    kr_scene scene;     /* with the start that was last set */
    kr_state start_low; /* low words of this start */
    const kr_method *method;
    kr_config config;
    int polls, patience; /* polls of this call; poll number `patience` stops the call */
    int forged;          /* its checkpoint was forged */
    int landed;          /* the top stands at a requested time, not at the end of a step */
    kr_state was;        /* state before the present call */
    kr_stats was_stats;
    int imaged; /* whether was_image holds the top's bytes before the present call */
    unsigned char was_image[MOST_IMAGE];
    search search[2]; /* the watched events, and others that may be chosen */
    int watched;
} place;

/* Returns 1, or -1 backward in time. */
double forward(const place *p);
/* Saves a top. Returns the number of bytes. */
size_t save_image(const kr_top *top, unsigned char *bytes);
/* begin_call and end_call enclose a call that moves a top. These functions claim what must hold for
 * every such call. */
void begin_call(place *p);
void end_call(place *p, kr_status status);
/* Returns a time for a top, not farther away than the round allows. */
double any_time(const place *p);
/* Returns the largest number of steps that a round repeats for comparison. */
int longest(void);
/* Returns a new top like that of `p`, but with these tangents and without poll and limits. The top
 * exists until the next call. */
kr_top *make_alike(const place *p, uint64_t tangents);

void call_step(place *p);
void call_advance(place *p);
void call_record(place *p);
void call_compare(place *p); /* compares with a top that goes to the same time directly */
void call_tangents(place *p);
void call_reset(place *p);
void call_set_scene(place *p);
void any_search(search *s); /* events, some of them invalid */
void call_watch(place *p);
void call_seek(place *p);
void call_save(place *p);   /* saves the top for later loads */
void call_load(place *p);   /* loads the bytes that were saved last, of this top or another */
void call_damage(place *p); /* loads bytes that were changed */
void call_forge(place *p);  /* loads changed bytes with a correct checksum */
void call_repeat(place *p); /* repeats a trajectory from a checkpoint */
void discard_checkpoint(void);
#endif
