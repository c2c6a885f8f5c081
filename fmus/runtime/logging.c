#include "logging.h"

#include <string.h>

static unsigned find(const char *name)
{
    if (name == NULL)
        return 0;
    for (unsigned category = 1; category < LOG_ALL; category *= 2)
        if (strcmp(name, log_name(category)) == 0)
            return category;
    return strcmp(name, "logAll") == 0 ? LOG_ALL : 0;
}

const char *log_name(unsigned category)
{
    if (category == LOG_EVENTS)
        return "logEvents";
    return category == LOG_DISCARD ? "logStatusDiscard" : "logStatusError";
}

const char *log_switch(unsigned *categories, int on, size_t count, const char *const names[])
{
    unsigned chosen = count == 0 ? LOG_ALL : 0;
    for (size_t i = 0; i < count; i++) {
        if (find(names[i]) == 0)
            return names[i] != NULL ? names[i] : "";
        chosen |= find(names[i]);
    }
    *categories = on ? *categories | chosen : *categories & ~chosen;
    return NULL;
}
