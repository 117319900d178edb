/* The calls of a round, by subject. */
#ifndef KR_CALLS_H
#define KR_CALLS_H

void call_bodies(void);       /* constructors, checks, kinds */
void call_names(void);        /* reading of tables */
void call_values(void);       /* quantities and other functions of a state */
void call_closed_forms(void); /* closed forms, and turning points */
void call_axes(void);         /* one motion in two orders of axes */
void call_ensembles(void);    /* workers */
void call_simulation(void);   /* the viewer's simulation and its pictures */
void call_top(void);          /* one call for one of the round's tops */
/* Allows tops to move so far that a call takes hundreds of steps. Most rounds do not. */
void allow_long_runs(int far);
void clear_tops(void); /* frees all tops */
void clear_simulation(void);
#endif
