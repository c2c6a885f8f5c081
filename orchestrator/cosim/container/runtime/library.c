#define _POSIX_C_SOURCE 200112L
#include "library.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define ENDING ".dll"
#define SYSTEM "windows"
#define SECOND "win64"
#else
#include <dlfcn.h>
#ifdef __APPLE__
#define ENDING ".dylib"
#define SYSTEM "darwin"
#define SECOND "darwin64" /* for both kinds of Mac */
#else
#define ENDING ".so"
#define SYSTEM "linux"
#define SECOND "linux64"
#endif
#endif
#if defined(__aarch64__) || defined(_M_ARM64)
#define MACHINE "aarch64"
#else
#define MACHINE "x86_64"
#endif

char *joined(const char *folder, const char *name)
{
    char *path = malloc(strlen(folder) + strlen(name) + 2);
    if (path != NULL)
        sprintf(path, "%s/%s", folder, name);
    return path;
}

static void *load(const char *path, char *problem, int size)
{
#ifdef _WIN32
    /* Its neighbours are looked for beside it. */
    void *library = (void *)LoadLibraryExA(path, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
    if (library == NULL)
        snprintf(problem, (size_t)size, "%s cannot be loaded (Windows error %lu)", path, (unsigned long)GetLastError());
#else
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL)
        snprintf(problem, (size_t)size, "%s", dlerror());
#endif
    return library;
}

static int is_there(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (file != NULL)
        fclose(file);
    return file != NULL;
}

void *library_open(const char *folder, const char *identifier, int version, char *problem, int size)
{
    static const char *const places[] = {SECOND, MACHINE "-" SYSTEM};
    for (int k = version == 2 ? 0 : 1; k < 2; k++) {
        char *path = malloc(strlen(folder) + strlen(identifier) + 64);
        if (path == NULL)
            return NULL;
        sprintf(path, "%s/binaries/%s/%s" ENDING, folder, places[k], identifier);
        void *library = is_there(path) ? load(path, problem, size) : NULL;
        int found = is_there(path);
        free(path);
        if (found)
            return library;
    }
    snprintf(problem, (size_t)size, "it has no binary %s" ENDING " for " MACHINE "-" SYSTEM, identifier);
    return NULL;
}

void *library_function(void *library, const char *name)
{
#ifdef _WIN32
    return (void *)GetProcAddress((HMODULE)library, name);
#else
    return dlsym(library, name);
#endif
}

void library_close(void *library)
{
    if (library == NULL)
        return;
#ifdef _WIN32
    FreeLibrary((HMODULE)library);
#else
    dlclose(library);
#endif
}

static int digit(char c)
{
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

char *path_of(const char *address)
{
    int is_address = strncmp(address, "file:", 5) == 0;
    const char *from = is_address ? address + 5 : address;
    if (is_address && strncmp(from, "//", 2) == 0) { /* a host, mostly empty, is between two and one slashes */
        const char *end = strchr(from + 2, '/');
        from = end != NULL ? end : from + 2;
    }
#ifdef _WIN32
    if (is_address && from[0] == '/' && from[1] != '\0' && from[2] == ':')
        from++;
#endif
    char *path = malloc(strlen(from) + 1), *to = path;
    if (path == NULL)
        return NULL;
    for (; *from != '\0'; from++) {
        int code = is_address && *from == '%' && digit(from[1]) >= 0 ? 16 * digit(from[1]) + digit(from[2]) : -1;
        *to++ = code > 0 ? (char)code : *from;
        from += code > 0 ? 2 : 0;
    }
    while (to > path + 1 && (to[-1] == '/' || to[-1] == '\\'))
        to--;
    *to = '\0';
    return path;
}

char *address_of(const char *path)
{
    static const char *const plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/:";
    char *address = malloc(3 * strlen(path) + 9), *to = address;
    if (address == NULL)
        return NULL;
    to += sprintf(to, path[0] == '/' ? "file://" : "file:///");
    for (; *path != '\0'; path++) {
        char c = *path == '\\' ? '/' : *path;
        to += strchr(plain, c) != NULL ? sprintf(to, "%c", c) : sprintf(to, "%%%02X", (unsigned char)c);
    }
    return address;
}
