/* Counts what the loop's thread of a real ravenposed takes from the heap or gives back: ravenpose-bench soak loads this in front of the C library.
   Two 64-bit numbers in the file that RAVENPOSE_ALLOCATIONS names: of that thread, and of all others. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

/* The C library's own, which this file's names hide. */
void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);
void *__libc_memalign(size_t, size_t);
void __libc_free(void *);

static uint64_t *counts;

__attribute__((constructor)) static void begin(void) {
    const char *path = getenv("RAVENPOSE_ALLOCATIONS");
    int file = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
    if (file < 0) return;
    void *mapped = mmap(NULL, 2 * sizeof *counts, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (mapped != MAP_FAILED) counts = mapped;
}

static void count(void) {
    char name[16] = "";
    if (!counts) return;
    prctl(PR_GET_NAME, name);
    __atomic_fetch_add(&counts[strcmp(name, "ravenpose-loop") != 0], 1, __ATOMIC_RELAXED);
}

void *malloc(size_t size) {
    count();
    return __libc_malloc(size);
}

void *calloc(size_t number, size_t size) {
    count();
    return __libc_calloc(number, size);
}

void *realloc(void *old, size_t size) {
    count();
    return __libc_realloc(old, size);
}

void *aligned_alloc(size_t alignment, size_t size) {
    count();
    return __libc_memalign(alignment, size);
}

int posix_memalign(void **to, size_t alignment, size_t size) {
    void *found = aligned_alloc(alignment, size);
    if (!found) return ENOMEM;
    *to = found;
    return 0;
}

void free(void *old) {
    if (old) count();
    __libc_free(old);
}
