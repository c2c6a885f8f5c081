/* Categories of messages, which an importer can switch on and off; the names are those of the standard. */
#ifndef MISFIT_LOGGING_H
#define MISFIT_LOGGING_H

#include <stddef.h>

#define LOG_EVENTS 1u
#define LOG_DISCARD 2u
#define LOG_ERROR 4u
#define LOG_ALL 7u
#define LOG_INITIALLY (LOG_DISCARD | LOG_ERROR) /* without the importer's wish for more */

#define LOG_NAMES "logEvents, logStatusDiscard, logStatusError and logAll"

const char *log_name(unsigned category);

/* Switches the named categories, or all if none is named; gives the first name that is unknown, else NULL, and then
 * nothing is switched. Names may be NULL pointers. */
const char *log_switch(unsigned *categories, int on, size_t count, const char *const names[]);

#endif
