/* Loggers for FMUs: keep the last message, with its variable arguments written out. Mirrored by fmu/messages.py. */
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>

typedef struct Record Record;
struct Record {
    int64_t count;
    int32_t status;
    char category[60], message[1024];
    Record *next; /* of those that are in use */
};

static Record *in_use;

void misfit_use(Record *record)
{
    record->next = in_use;
    in_use = record;
}

void misfit_forget(Record *record)
{
    Record **place = &in_use;
    while (*place != NULL && *place != record)
        place = &(*place)->next;
    if (*place != NULL)
        *place = record->next;
}

/* An FMU of version 1 passes its instance, which leads nowhere here; some of version 2 do so by mistake. */
Record misfit_last1;

void misfit_log1(void *instance, const char *name, int status, const char *category, const char *message, ...)
{
    (void)instance, (void)name;
    if (message == NULL)
        return;
    va_list arguments;
    va_start(arguments, message);
    vsnprintf(misfit_last1.message, sizeof misfit_last1.message, message, arguments);
    va_end(arguments);
    snprintf(misfit_last1.category, sizeof misfit_last1.category, "%s", category != NULL ? category : "");
    misfit_last1.status = status;
    misfit_last1.count++;
}

void misfit_log2(void *environment, const char *name, int status, const char *category, const char *message, ...)
{
    Record *record = in_use;
    (void)name;
    while (record != NULL && record != environment)
        record = record->next;
    if (record == NULL)
        record = &misfit_last1;
    if (message == NULL)
        return;
    va_list arguments;
    va_start(arguments, message);
    vsnprintf(record->message, sizeof record->message, message, arguments);
    va_end(arguments);
    snprintf(record->category, sizeof record->category, "%s", category != NULL ? category : "");
    record->status = status;
    record->count++;
}

void misfit_log3(void *environment, int status, const char *category, const char *message)
{
    misfit_log2(environment, NULL, status, category, "%s", message != NULL ? message : "");
}
