/* Loggers for FMUs: keep the last message, with its variable arguments written out. Mirrored by fmu/messages.py. */
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>

typedef struct {
    int64_t count;
    int32_t status;
    char category[60], message[1024];
} Record;

/* An FMU of version 1 passes its instance, which leads nowhere here. */
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
    Record *record = environment;
    (void)name;
    if (record == NULL || message == NULL)
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
