// A disk that stands still, or refuses, below one folder, while a file says so. To be preloaded:
//
//   LD_PRELOAD=trouble.so TROUBLE_BELOW=/the/folder TROUBLE_FLAGS=/flags PROGRAM
//
// While /flags/stalls exists, what writes or syncs there waits; while /flags/refuses exists, it fails with
// the error whose number stands in that file.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static int is_below(int fd) {
  const char *below = getenv("TROUBLE_BELOW");
  char link[64], path[4096];
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  ssize_t length = readlink(link, path, sizeof path - 1);
  if (!below || length < 0) return 0;
  path[length] = 0;
  return strncmp(path, below, strlen(below)) == 0;
}

// Waits as long as the disk stands still; the error that it fails with then, or 0.
static int trouble(int fd) {
  const char *flags = getenv("TROUBLE_FLAGS");
  if (!flags || !is_below(fd)) return 0;
  int before = errno, number = 0;
  char stalls[4096], refuses[4096];
  snprintf(stalls, sizeof stalls, "%s/stalls", flags);
  snprintf(refuses, sizeof refuses, "%s/refuses", flags);
  while (access(stalls, F_OK) == 0) usleep(10000);
  // stdio would go through our own write() only for what is written; reading is not touched.
  FILE *file = fopen(refuses, "re");
  if (file && fscanf(file, "%d", &number) != 1) number = EIO;
  if (file) fclose(file);
  errno = before;
  return number;
}

#define IN_TROUBLE(RESULT, NAME, PARAMETERS, ...)                        \
  RESULT NAME PARAMETERS {                                               \
    static RESULT(*real) PARAMETERS;                                     \
    if (!real) real = (RESULT(*) PARAMETERS)dlsym(RTLD_NEXT, #NAME);     \
    int error = trouble(fd);                                             \
    if (error) {                                                         \
      errno = error;                                                     \
      return -1;                                                         \
    }                                                                    \
    return real(__VA_ARGS__);                                            \
  }

IN_TROUBLE(ssize_t, write, (int fd, const void *bytes, size_t count), fd, bytes, count)
IN_TROUBLE(ssize_t, writev, (int fd, const struct iovec *parts, int count), fd, parts, count)
IN_TROUBLE(ssize_t, pwrite, (int fd, const void *bytes, size_t count, off_t at), fd, bytes, count, at)
IN_TROUBLE(ssize_t, pwrite64, (int fd, const void *bytes, size_t count, off64_t at), fd, bytes, count, at)
IN_TROUBLE(int, fsync, (int fd), fd)
IN_TROUBLE(int, fdatasync, (int fd), fd)
