/* Kernel CAN sockets on a socketcand server, for LD_PRELOAD: what a program sends on a PF_CAN socket goes to the server at
   127.0.0.1:$CAN_SHIM_PORT as text, and back. The program's end is a socket pair; a thread translates. Frames are written to
   $CAN_SHIM_LOG in the notation of candump, with T for those sent. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <dlfcn.h>
#include <errno.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

static int program = -1, inner = -1, server = -1;
static FILE *log_file;
static struct can_filter filter;
static int is_filtered;

static void note(char way, const struct can_frame *frame) {
    struct timespec now;
    if (!log_file) return;
    clock_gettime(CLOCK_MONOTONIC, &now);
    fprintf(log_file, "%lld.%09ld %c %03X#", (long long)now.tv_sec, now.tv_nsec, way, frame->can_id);
    for (int i = 0; i < frame->can_dlc; i++) fprintf(log_file, "%02X", frame->data[i]);
    fputc('\n', log_file);
    fflush(log_file);
}

static void to_server(const struct can_frame *frame) {
    char text[96];
    int length = sprintf(text, "< send %X %X", frame->can_id, frame->can_dlc);
    for (int i = 0; i < frame->can_dlc; i++) length += sprintf(text + length, " %x", frame->data[i]);
    length += sprintf(text + length, " >");
    note('T', frame);
    if (write(server, text, length) != length) perror("can_shim: the server does not take a frame");
}

/* As the kernel does: an inverted filter lets through what does not fit. */
static int passes(const struct can_frame *frame) {
    if (!is_filtered) return 1;
    int fits = (frame->can_id & filter.can_mask) == (filter.can_id & ~CAN_INV_FILTER & filter.can_mask);
    return (filter.can_id & CAN_INV_FILTER) ? !fits : fits;
}

static void to_program(const char *message) {
    struct can_frame frame = {0};
    unsigned identifier, byte;
    double when;
    char hex[64] = "";
    const char *found = strstr(message, "frame");
    if (!found || sscanf(found, "frame %x %lf %63s", &identifier, &when, hex) < 2) return;
    frame.can_id = identifier;
    frame.can_dlc = strlen(hex) / 2;
    for (int i = 0; i < frame.can_dlc && sscanf(hex + 2 * i, "%2x", &byte) == 1; i++) frame.data[i] = byte;
    note('R', &frame);
    if (passes(&frame) && send(inner, &frame, sizeof frame, MSG_DONTWAIT) < 0) fprintf(stderr, "can_shim: queue is full\n");
}

static void *pump(void *unused) {
    static char text[65536];
    int waiting = 0;
    for (;;) {
        struct pollfd ends[2] = {{inner, POLLIN, 0}, {server, POLLIN, 0}};
        struct can_frame frame;
        if (poll(ends, 2, -1) < 0) continue;
        if (ends[0].revents && recv(inner, &frame, sizeof frame, MSG_DONTWAIT) == sizeof frame) to_server(&frame);
        if (!ends[1].revents) continue;
        ssize_t got = read(server, text + waiting, sizeof text - 1 - waiting);
        if (got <= 0) return NULL;
        text[waiting += got] = 0;
        char *rest = text;
        for (char *end; (end = strchr(rest, '>')); rest = end + 1) {
            *end = 0;
            to_program(rest);
        }
        waiting = strlen(rest);
        memmove(text, rest, waiting + 1);
    }
}

static void hear_greeting(void) {
    char byte = 0;
    while (byte != '>' && read(server, &byte, 1) == 1) {
    }
}

static int say(const char *words) {
    if (write(server, words, strlen(words)) < 0) return -1;
    hear_greeting();
    return 0;
}

int socket(int domain, int type, int protocol) {
    int (*real)(int, int, int) = dlsym(RTLD_NEXT, "socket");
    int pair[2], big = 1 << 20, on = 1;
    pthread_t thread;
    if (domain != PF_CAN) return real(domain, type, protocol);
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    address.sin_port = htons(atoi(getenv("CAN_SHIM_PORT") ? getenv("CAN_SHIM_PORT") : "29536"));
    server = real(AF_INET, SOCK_STREAM, 0);
    if (socketpair(AF_UNIX, SOCK_SEQPACKET, 0, pair) || connect(server, (void *)&address, sizeof address)) {
        errno = ENODEV;
        return -1;
    }
    setsockopt(server, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    for (int i = 0; i < 2; i++) setsockopt(pair[i], SOL_SOCKET, SO_SNDBUF, &big, sizeof big);
    hear_greeting();
    if (say("< open can0 >") || say("< rawmode >")) return -1;
    if (getenv("CAN_SHIM_LOG")) log_file = fopen(getenv("CAN_SHIM_LOG"), "w");
    program = pair[0], inner = pair[1];
    pthread_create(&thread, NULL, pump, NULL);
    return program;
}

int bind(int handle, const struct sockaddr *address, socklen_t length) {
    int (*real)(int, const struct sockaddr *, socklen_t) = dlsym(RTLD_NEXT, "bind");
    return handle == program ? 0 : real(handle, address, length);
}

int setsockopt(int handle, int level, int name, const void *value, socklen_t length) {
    int (*real)(int, int, int, const void *, socklen_t) = dlsym(RTLD_NEXT, "setsockopt");
    if (handle != program || level != SOL_CAN_RAW) return real(handle, level, name, value, length);
    if (name == CAN_RAW_FILTER && length == sizeof filter) filter = *(const struct can_filter *)value, is_filtered = 1;
    return 0;
}

int ioctl(int handle, unsigned long request, ...) {
    int (*real)(int, unsigned long, ...) = dlsym(RTLD_NEXT, "ioctl");
    va_list rest;
    va_start(rest, request);
    void *argument = va_arg(rest, void *);
    va_end(rest);
    if (handle != program || request != SIOCGIFINDEX) return real(handle, request, argument);
    ((struct ifreq *)argument)->ifr_ifindex = 3;
    return 0;
}
