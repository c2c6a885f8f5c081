/* Loggers for FMUs: keep the last message, with its variable arguments written out. Mirrored by fmu/messages.py. */
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>

typedef struct {
    int64_t count;
    int32_t status;
    char category[60], message[1024];
} Record;

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
