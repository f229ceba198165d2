/* Memory files in place of dma-bufs, for a kernel without udmabuf and dma heaps: preloaded, it answers /dev/udmabuf and
 * /dev/dma_heap/ itself. Source: linux/udmabuf.h, linux/dma-heap.h, linux/dma-buf.h. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/dma-buf.h>
#include <linux/dma-heap.h>
#include <linux/udmabuf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

static int is_provider(const char *path)
{
    return !strcmp(path, "/dev/udmabuf") || !strncmp(path, "/dev/dma_heap/", 14);
}

static int open_it(const char *path, int flags, mode_t mode)
{
    if (is_provider(path))
        return memfd_create("dma-buf provider", MFD_CLOEXEC);
    return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}

#define OPEN(name)                                                                                                      \
    int name(const char *path, int flags, ...)                                                                          \
    {                                                                                                                   \
        va_list more;                                                                                                   \
        va_start(more, flags);                                                                                          \
        mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(more, mode_t) : 0;                                       \
        va_end(more);                                                                                                   \
        return open_it(path, flags, mode);                                                                              \
    }
OPEN(open)
OPEN(open64)

int __open_2(const char *path, int flags) { return open_it(path, flags, 0); }
int __open64_2(const char *path, int flags) { return open_it(path, flags, 0); }

int ioctl(int fd, unsigned long request, ...)
{
    va_list more;
    va_start(more, request);
    void *argument = va_arg(more, void *);
    va_end(more);

    if (request == UDMABUF_CREATE)
        return fcntl((int)((struct udmabuf_create *)argument)->memfd, F_DUPFD_CLOEXEC, 0);
    if (request == DMA_HEAP_IOCTL_ALLOC) {
        struct dma_heap_allocation_data *wanted = argument;
        int memory = memfd_create("dma-buf", MFD_CLOEXEC);
        if (memory < 0 || ftruncate(memory, (off_t)wanted->len) < 0)
            return -1;
        wanted->fd = (unsigned)memory;
        return 0;
    }
    if (request == DMA_BUF_IOCTL_SYNC || request == DMA_BUF_SET_NAME_A || request == DMA_BUF_SET_NAME_B)
        return 0;
    return (int)syscall(SYS_ioctl, fd, request, argument);
}
