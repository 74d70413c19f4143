/* A disk that stalls: preloaded (LD_PRELOAD), every write to a regular file waits while the file
   that STALL_WHILE names exists. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

static void wait_for_disk(int fd) {
    struct stat found;
    const char *flag = getenv("STALL_WHILE");
    if (!flag || fstat(fd, &found) || !S_ISREG(found.st_mode)) return;
    while (!access(flag, F_OK)) usleep(10000);
}

#define REAL(type, name, ...) \
    static type (*real)(__VA_ARGS__); \
    if (!real) real = (type (*)(__VA_ARGS__))dlsym(RTLD_NEXT, #name)

ssize_t write(int fd, const void *data, size_t size) {
    REAL(ssize_t, write, int, const void *, size_t);
    wait_for_disk(fd);
    return real(fd, data, size);
}

ssize_t pwrite(int fd, const void *data, size_t size, off_t offset) {
    REAL(ssize_t, pwrite, int, const void *, size_t, off_t);
    wait_for_disk(fd);
    return real(fd, data, size, offset);
}

ssize_t pwrite64(int fd, const void *data, size_t size, off64_t offset) {
    REAL(ssize_t, pwrite64, int, const void *, size_t, off64_t);
    wait_for_disk(fd);
    return real(fd, data, size, offset);
}

int ftruncate(int fd, off_t size) {
    REAL(int, ftruncate, int, off_t);
    wait_for_disk(fd);
    return real(fd, size);
}

int ftruncate64(int fd, off64_t size) {
    REAL(int, ftruncate64, int, off64_t);
    wait_for_disk(fd);
    return real(fd, size);
}

int fsync(int fd) {
    REAL(int, fsync, int);
    wait_for_disk(fd);
    return real(fd);
}

int fdatasync(int fd) {
    REAL(int, fdatasync, int);
    wait_for_disk(fd);
    return real(fd);
}
