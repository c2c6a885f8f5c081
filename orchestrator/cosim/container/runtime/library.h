/* Loading shared libraries, and where they lie. */
#ifndef MISFIT_LIBRARY_H
#define MISFIT_LIBRARY_H

/* The binary of an FMU for this machine, below its unpacked folder; NULL with the reason where there is none. */
void *library_open(const char *folder, const char *identifier, int version, char *problem, int size);
void *library_function(void *library, const char *name);
void library_close(void *library);

/* A path for `file:` addresses and paths, without a separator at its end; to be freed. */
char *path_of(const char *address);
/* The address of a path; to be freed. */
char *address_of(const char *path);
char *joined(const char *folder, const char *name);

#endif
