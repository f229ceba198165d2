/* An I2C bus for a program that knows nothing of it: loaded by LD_PRELOAD, it opens /dev/i2c-N as the Unix socket
 * $TSIS_RIG_I2C and carries each I2C_RDWR there (tests/i2c_over_socket.py serves it and states the format). Everything
 * else is the C library's own. Source: linux/i2c-dev.h, linux/i2c.h; ld.so(8); a real bus answers with the same errno.
 * Build: gcc -O2 -shared -fPIC -o i2c_shim.so i2c_shim.c -ldl
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#define MOST_FDS 4096
#define LONGEST 65536
static char is_bus[MOST_FDS];

static int is_bus_path(const char *path) { return path && strncmp(path, "/dev/i2c-", 9) == 0; }

static int open_bus(void) {
    const char *path = getenv("TSIS_RIG_I2C");
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (!path || strlen(path) >= sizeof address.sun_path) return errno = ENOENT, -1;
    strcpy(address.sun_path, path);
    int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    if (fd < 0) return -1;
    if (fd >= MOST_FDS || connect(fd, (struct sockaddr *)&address, sizeof address) < 0) {
        close(fd);
        return errno = ENOENT, -1; /* as a board without that bus */
    }
    is_bus[fd] = 1;
    return fd;
}

#define MODE(flags, last) \
    mode_t mode = 0; \
    if ((flags) & (O_CREAT | __O_TMPFILE)) { va_list rest; va_start(rest, last); mode = va_arg(rest, mode_t); va_end(rest); }
#define OPEN(name) \
    int name(const char *path, int flags, ...) { \
        MODE(flags, flags) \
        if (is_bus_path(path)) return open_bus(); \
        int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, #name); \
        return real(path, flags, mode); \
    }
#define OPENAT(name) \
    int name(int folder, const char *path, int flags, ...) { \
        MODE(flags, flags) \
        if (is_bus_path(path)) return open_bus(); \
        int (*real)(int, const char *, int, ...) = dlsym(RTLD_NEXT, #name); \
        return real(folder, path, flags, mode); \
    }
OPEN(open)
OPEN(open64)
OPENAT(openat)
OPENAT(openat64)

int close(int fd) {
    static int (*real)(int);
    if (!real) real = dlsym(RTLD_NEXT, "close");
    if (fd >= 0 && fd < MOST_FDS) is_bus[fd] = 0;
    return real(fd);
}

static size_t put(uint8_t *at, uint16_t value) { return memcpy(at, &value, 2), 2; }

static int carry(int fd, struct i2c_rdwr_ioctl_data *asked) {
    static __thread uint8_t packet[LONGEST];
    size_t size = put(packet, asked->nmsgs);
    for (unsigned i = 0; i < asked->nmsgs; i++) {
        struct i2c_msg *one = &asked->msgs[i];
        if (size + 6 + one->len > LONGEST) return errno = EINVAL, -1;
        size += put(packet + size, one->addr);
        size += put(packet + size, one->flags);
        size += put(packet + size, one->len);
        if (!(one->flags & I2C_M_RD)) size += (memcpy(packet + size, one->buf, one->len), one->len);
    }
    if (send(fd, packet, size, MSG_NOSIGNAL) < 0) return errno = EREMOTEIO, -1;
    ssize_t got = recv(fd, packet, LONGEST, 0);
    int32_t error = EREMOTEIO;
    if (got >= 4) memcpy(&error, packet, 4);
    if (error) return errno = error, -1;
    uint8_t *at = packet + 4;
    for (unsigned i = 0; i < asked->nmsgs; i++) {
        struct i2c_msg *one = &asked->msgs[i];
        if (!(one->flags & I2C_M_RD)) continue;
        if (at + one->len > packet + got) return errno = EREMOTEIO, -1;
        memcpy(one->buf, at, one->len);
        at += one->len;
    }
    return (int)asked->nmsgs;
}

int ioctl(int fd, unsigned long request, ...) {
    va_list rest;
    va_start(rest, request);
    void *argument = va_arg(rest, void *);
    va_end(rest);
    if (fd >= 0 && fd < MOST_FDS && is_bus[fd]) {
        if (request == I2C_FUNCS) return *(unsigned long *)argument = I2C_FUNC_I2C, 0;
        if (request == I2C_RDWR) return carry(fd, argument);
        return errno = ENOTTY, -1;
    }
    int (*real)(int, unsigned long, ...) = dlsym(RTLD_NEXT, "ioctl");
    return real(fd, request, argument);
}
