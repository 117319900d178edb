/* The calls that a round is made of, by what they belong to. */
#ifndef KR_CALLS_H
#define KR_CALLS_H

void call_bodies(void); /* makers, checks, kinds */
void call_names(void);  /* tables that are read */
void call_values(void); /* quantities and other functions of a state */
void call_closed(void); /* closed forms and the map's */
void call_axes(void);   /* one motion in two orders of axes */
void call_many(void);   /* workers */
void call_steady(void); /* motions that have a formula */
void call_stage(void);  /* the stage of the page, and its pictures */
void call_top(void);    /* one call of one of a few tops */
/* Whether its tops may go so far that a call takes hundreds of steps, which most rounds forgo. */
void go_far(int far);
void clear_tops(void); /* frees them all */
void clear_stage(void);
#endif
