/* Notes every change that a process makes to the files of one folder, in order.

   Preloaded (LD_PRELOAD) with CRASH_FOLDER (absolute) and CRASH_LOG. Each change is a record in the
   log: a letter, three 64-bit numbers (offset, length of the name, length of the data), the name,
   the data. W: data written at offset; T: cut or grown to offset; C: created or emptied;
   R: renamed, the data being the new name; L: linked, likewise; U: unlinked. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int log_fd = -1;

#define REAL(type, name, ...) \
    static type (*real)(__VA_ARGS__); \
    if (!real) real = (type (*)(__VA_ARGS__))dlsym(RTLD_NEXT, #name)

static ssize_t put(int fd, const void *data, size_t size) {
    REAL(ssize_t, write, int, const void *, size_t);
    return real(fd, data, size);
}

static int inside(const char *path) {
    const char *folder = getenv("CRASH_FOLDER");
    size_t n = folder ? strlen(folder) : 0;
    return n && !strncmp(path, folder, n) && path[n] == '/';
}

static void note(char what, uint64_t offset, const char *name, const void *data, uint64_t size) {
    pthread_mutex_lock(&lock);
    if (log_fd < 0) {
        int (*open_real)(const char *, int, ...) =
            (int (*)(const char *, int, ...))dlsym(RTLD_NEXT, "open");
        log_fd = open_real(getenv("CRASH_LOG"), O_WRONLY | O_CREAT | O_APPEND, 0600);
    }
    uint64_t numbers[3] = {offset, strlen(name), size};
    put(log_fd, &what, 1);
    put(log_fd, numbers, sizeof numbers);
    put(log_fd, name, numbers[1]);
    for (uint64_t done = 0; done < size;) {
        ssize_t n = put(log_fd, (const char *)data + done, size - done);
        if (n <= 0) abort();
        done += (uint64_t)n;
    }
    pthread_mutex_unlock(&lock);
}

static int name_of(int fd, char *name) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, name, PATH_MAX - 1);
    if (n < 0) return 0;
    name[n] = 0;
    return inside(name);
}

static void opened(const char *path, int flags, int existed) {
    char full[PATH_MAX];
    if (!(flags & (O_CREAT | O_TRUNC))) return;
    if (existed && !(flags & O_TRUNC)) return;
    if (realpath(path, full) && inside(full)) note('C', 0, full, "", 0);
}

#define OPEN(name) \
    int name(const char *path, int flags, ...) { \
        REAL(int, name, const char *, int, ...); \
        va_list rest; \
        va_start(rest, flags); \
        mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0; \
        va_end(rest); \
        int existed = !access(path, F_OK); \
        int fd = real(path, flags, mode); \
        if (fd >= 0) opened(path, flags, existed); \
        return fd; \
    }
OPEN(open)
OPEN(open64)

ssize_t write(int fd, const void *data, size_t size) {
    char name[PATH_MAX];
    int noted = fd != log_fd && name_of(fd, name);
    off_t at = noted ? lseek(fd, 0, SEEK_CUR) : 0;
    ssize_t done = put(fd, data, size);
    if (noted && done > 0) note('W', (uint64_t)at, name, data, (uint64_t)done);
    return done;
}

#define PWRITE(name) \
    ssize_t name(int fd, const void *data, size_t size, off_t at) { \
        REAL(ssize_t, name, int, const void *, size_t, off_t); \
        char path[PATH_MAX]; \
        ssize_t done = real(fd, data, size, at); \
        if (done > 0 && name_of(fd, path)) note('W', (uint64_t)at, path, data, (uint64_t)done); \
        return done; \
    }
PWRITE(pwrite)
PWRITE(pwrite64)

#define TRUNCATE(name) \
    int name(int fd, off_t size) { \
        REAL(int, name, int, off_t); \
        char path[PATH_MAX]; \
        int done = real(fd, size); \
        if (!done && name_of(fd, path)) note('T', (uint64_t)size, path, "", 0); \
        return done; \
    }
TRUNCATE(ftruncate)
TRUNCATE(ftruncate64)

int rename(const char *from, const char *to) {
    REAL(int, rename, const char *, const char *);
    char full[PATH_MAX], target[PATH_MAX];
    int known = realpath(from, full) && inside(full);
    int done = real(from, to);
    if (!done && known && realpath(to, target)) note('R', 0, full, target, strlen(target));
    return done;
}

int link(const char *from, const char *to) {
    REAL(int, link, const char *, const char *);
    char full[PATH_MAX], target[PATH_MAX];
    int known = realpath(from, full) && inside(full);
    int done = real(from, to);
    if (!done && known && realpath(to, target)) note('L', 0, full, target, strlen(target));
    return done;
}

int unlink(const char *path) {
    REAL(int, unlink, const char *);
    char full[PATH_MAX];
    int known = realpath(path, full) && inside(full);
    int done = real(path);
    if (!done && known) note('U', 0, full, "", 0);
    return done;
}
