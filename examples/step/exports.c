/* The functions of kreisel_step.h with external names, for other languages. */
#define KR_STEP_API
#include <kreisel_step.h>
