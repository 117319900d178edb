/* The few tops of a round, and what is known of each beside what it says of itself. */
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
    kr_scene scene; /* with the start that was last set */
    const kr_method *method;
    kr_config config;
    int polls, patience; /* asked so often in this call; says stop when asked for the last time */
    int forged;          /* its numbers are made up */
    int landed;          /* it stands at a time that was asked for, not where a step ended */
    kr_state was;        /* before the call that is made now */
    kr_stats was_stats;
    int imaged; /* whether its bytes before that call are in was_image */
    unsigned char was_image[MOST_IMAGE];
    search search[2]; /* that which is watched, and one to be filled */
    int watched;
} place;

/* 1 for forward in time, or -1. */
double forward(const place *p);
/* The bytes that a top is saved in, of any length; how many there are. */
size_t image_of(const kr_top *top, unsigned char *bytes);
/* Before a call of what moves a top, and after it: claims all that holds of every such call. */
void begin_call(place *p);
void end_call(place *p, kr_status status);
/* A time for such a top to go to, as far as the round goes. */
double any_time(const place *p);
/* So many steps at most are made once more, to compare what comes of them. */
int longest(void);
/* Makes a top alike, but with these tangents, which asks nobody and has no limits, and lives until
 * the next is made. */
kr_top *make_alike(const place *p, uint64_t tangents);

void call_step(place *p);
void call_advance(place *p);
void call_record(place *p);
void call_compare(place *p); /* with a top that goes there at once */
void call_tangents(place *p);
void call_reset(place *p);
void any_search(search *s); /* events, of which none may be one */
void call_watch(place *p);
void call_seek(place *p);
void call_save(place *p);   /* keeps its bytes for later loads */
void call_load(place *p);   /* the bytes kept last, of this top or another */
void call_damage(place *p); /* bytes that are not as they were */
void call_forge(place *p);  /* bytes that are not as they were, with a sum that is right */
void call_repeat(place *p); /* the same way again, from a checkpoint */
void forget_saved(void);
#endif
