/* Calls that fail: preloaded (LD_PRELOAD), the n-th call of a kind fails after fault_arm(kinds, n).

   Kinds, by their bits: 1 what changes a regular file (fails as on a full disk), 2 an allocation of
   1 KiB or more, 4 a lock of a file. fault_count returns how many calls there have been. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stddef.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { CHANGE = 1, ALLOCATION = 2, LOCK = 4 };
enum { LARGE = 1024 };

static volatile int kinds;
static volatile long wanted, calls;

void fault_arm(int which, long n) {
    calls = 0;
    wanted = n;
    kinds = which;
}

long fault_count(void) { return calls; }

static int fails(int kind) { return (kinds & kind) && __sync_add_and_fetch(&calls, 1) == wanted; }

static int refused(int kind, int number) {
    if (!fails(kind)) return 0;
    errno = number;
    return 1;
}

static int regular(int fd) {
    struct stat found;
    int before = errno, is = kinds && !fstat(fd, &found) && S_ISREG(found.st_mode);
    errno = before;
    return is;
}

#define REAL(type, name, ...) \
    static type (*real)(__VA_ARGS__); \
    if (!real) real = (type (*)(__VA_ARGS__))dlsym(RTLD_NEXT, #name)

ssize_t write(int fd, const void *data, size_t size) {
    REAL(ssize_t, write, int, const void *, size_t);
    return regular(fd) && refused(CHANGE, ENOSPC) ? -1 : real(fd, data, size);
}

ssize_t pwrite(int fd, const void *data, size_t size, off_t offset) {
    REAL(ssize_t, pwrite, int, const void *, size_t, off_t);
    return regular(fd) && refused(CHANGE, ENOSPC) ? -1 : real(fd, data, size, offset);
}

ssize_t pwrite64(int fd, const void *data, size_t size, off64_t offset) {
    REAL(ssize_t, pwrite64, int, const void *, size_t, off64_t);
    return regular(fd) && refused(CHANGE, ENOSPC) ? -1 : real(fd, data, size, offset);
}

ssize_t pwritev(int fd, const struct iovec *parts, int count, off_t offset) {
    REAL(ssize_t, pwritev, int, const struct iovec *, int, off_t);
    return regular(fd) && refused(CHANGE, ENOSPC) ? -1 : real(fd, parts, count, offset);
}

int ftruncate(int fd, off_t size) {
    REAL(int, ftruncate, int, off_t);
    return regular(fd) && refused(CHANGE, ENOSPC) ? -1 : real(fd, size);
}

int ftruncate64(int fd, off64_t size) {
    REAL(int, ftruncate64, int, off64_t);
    return regular(fd) && refused(CHANGE, ENOSPC) ? -1 : real(fd, size);
}

int fsync(int fd) {
    REAL(int, fsync, int);
    return regular(fd) && refused(CHANGE, EIO) ? -1 : real(fd);
}

int fdatasync(int fd) {
    REAL(int, fdatasync, int);
    return regular(fd) && refused(CHANGE, EIO) ? -1 : real(fd);
}

#define OPEN(name) \
    int name(const char *path, int flags, ...) { \
        REAL(int, name, const char *, int, ...); \
        va_list rest; \
        va_start(rest, flags); \
        int mode = va_arg(rest, int); \
        va_end(rest); \
        return (flags & O_CREAT) && refused(CHANGE, ENOSPC) ? -1 : real(path, flags, mode); \
    }
OPEN(open)
OPEN(open64)

#define OPENAT(name) \
    int name(int at, const char *path, int flags, ...) { \
        REAL(int, name, int, const char *, int, ...); \
        va_list rest; \
        va_start(rest, flags); \
        int mode = va_arg(rest, int); \
        va_end(rest); \
        return (flags & O_CREAT) && refused(CHANGE, ENOSPC) ? -1 : real(at, path, flags, mode); \
    }
OPENAT(openat)
OPENAT(openat64)

int rename(const char *from, const char *to) {
    REAL(int, rename, const char *, const char *);
    return refused(CHANGE, EIO) ? -1 : real(from, to);
}

int renameat(int a, const char *from, int b, const char *to) {
    REAL(int, renameat, int, const char *, int, const char *);
    return refused(CHANGE, EIO) ? -1 : real(a, from, b, to);
}

int unlink(const char *path) {
    REAL(int, unlink, const char *);
    return refused(CHANGE, EIO) ? -1 : real(path);
}

int unlinkat(int at, const char *path, int flags) {
    REAL(int, unlinkat, int, const char *, int);
    return refused(CHANGE, EIO) ? -1 : real(at, path, flags);
}

int flock(int fd, int how) {
    REAL(int, flock, int, int);
    return how != LOCK_UN && refused(LOCK, ENOLCK) ? -1 : real(fd, how);
}

#define FCNTL(name) \
    int name(int fd, int what, ...) { \
        REAL(int, name, int, int, ...); \
        va_list rest; \
        va_start(rest, what); \
        void *argument = va_arg(rest, void *); \
        va_end(rest); \
        int locks = what == F_SETLK || what == F_SETLKW || what == F_OFD_SETLK; \
        return locks && refused(LOCK, ENOLCK) ? -1 : real(fd, what, argument); \
    }
FCNTL(fcntl)
FCNTL(fcntl64)

/* the C library's own names: dlsym allocates memory itself */
void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);

void *malloc(size_t size) {
    return size >= LARGE && refused(ALLOCATION, ENOMEM) ? NULL : __libc_malloc(size);
}

void *calloc(size_t count, size_t size) {
    return count * size >= LARGE && refused(ALLOCATION, ENOMEM) ? NULL : __libc_calloc(count, size);
}

void *realloc(void *old, size_t size) {
    return size >= LARGE && refused(ALLOCATION, ENOMEM) ? NULL : __libc_realloc(old, size);
}
