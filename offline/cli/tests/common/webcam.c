/* A webcam without hardware, preloaded into the program under test: /dev/ravenpose-webcamN answers as a webcam's driver does, by
 * linux/videodev2.h itself. Images are begun by the clock, one a period, stamped with that moment, and handed over 5 to 27 ms later.
 *   RAVENPOSE_WEBCAM_JPEG  file with the image
 *   RAVENPOSE_WEBCAM_LOG   file to which "DEVICE SEQUENCE STAMP_NS" is added for each image handed over
 *   RAVENPOSE_WEBCAM_IS    "yuyv": no Motion JPEG; "large": another size than asked for; "blind": no camera; "unplugged": gone after
 *                          ten images; "lossy": every third image is broken */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#define NAME "/dev/ravenpose-webcam"
#define BUFFERS 4
#define ROOM (1 << 20)
#define DEVICES 16

static struct device {
    int fd, number, on;
    unsigned queue[BUFFERS], first, waiting, sequence;
    long long period_ns, begin_ns;
} devices[DEVICES];
static int count;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static int is(const char *what) {
    const char *said = getenv("RAVENPOSE_WEBCAM_IS");
    return said && !strcmp(said, what);
}

static long long now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000LL + now.tv_nsec;
}

static int failed(int number) {
    errno = number;
    return -1;
}

static int open_webcam(const char *path) {
    int fd = memfd_create("webcam", 0);
    if (fd < 0 || ftruncate(fd, BUFFERS * ROOM)) return -1;
    pthread_mutex_lock(&lock);
    if (count < DEVICES) {
        struct device fresh = {.fd = fd, .number = atoi(path + strlen(NAME)), .period_ns = 33333333};
        devices[count++] = fresh;
    }
    pthread_mutex_unlock(&lock);
    return fd;
}

static struct device *device_of(int fd) {
    for (int index = 0; index < count; index++)
        if (devices[index].fd == fd) return &devices[index];
    return NULL;
}

#define OPEN(name)                                                                   \
    int name(const char *path, int flags, ...) {                                     \
        va_list more;                                                                \
        va_start(more, flags);                                                       \
        mode_t mode = va_arg(more, mode_t);                                          \
        va_end(more);                                                                \
        if (!strncmp(path, NAME, strlen(NAME))) return open_webcam(path);            \
        int (*real)(const char *, int, ...) = (int (*)(const char *, int, ...))dlsym(RTLD_NEXT, #name); \
        return real(path, flags, mode);                                              \
    }
OPEN(open)
OPEN(open64)

/* Waits for the next image, puts it into the first buffer that was given, and says which. */
static int hand_over(struct device *device, struct v4l2_buffer *buffer) {
    if (!device->on || !device->waiting) return failed(EAGAIN);
    if (is("unplugged") && device->sequence == 10) return failed(ENODEV);
    unsigned index = device->queue[device->first], sequence = device->sequence++;
    device->first = (device->first + 1) % BUFFERS;
    device->waiting--;
    long long stamp = device->begin_ns + sequence * device->period_ns, due = stamp + (5 + sequence * 7 % 23) * 1000000LL;
    struct timespec until = {.tv_sec = due / 1000000000, .tv_nsec = due % 1000000000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
    int broken = is("lossy") && sequence % 3 == 2;
    static char image[ROOM];
    pthread_mutex_lock(&lock);
    FILE *file = fopen(getenv("RAVENPOSE_WEBCAM_JPEG"), "rb");
    size_t size = file ? fread(image, 1, ROOM, file) : 0;
    if (file) fclose(file);
    size = broken ? size / 2 : size;
    ssize_t put = pwrite(device->fd, image, size, (off_t)index * ROOM);
    const char *log = getenv("RAVENPOSE_WEBCAM_LOG");
    if (log && !broken && (file = fopen(log, "a"))) {
        fprintf(file, "%d %u %lld\n", device->number, sequence, stamp / 1000 * 1000);
        fclose(file);
    }
    pthread_mutex_unlock(&lock);
    memset(buffer, 0, sizeof *buffer);
    buffer->index = index;
    buffer->type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer->memory = V4L2_MEMORY_MMAP;
    buffer->bytesused = put < 0 ? 0 : put;
    buffer->flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE | V4L2_BUF_FLAG_MAPPED |
                    (broken ? V4L2_BUF_FLAG_ERROR : V4L2_BUF_FLAG_DONE);
    buffer->sequence = sequence;
    buffer->timestamp.tv_sec = stamp / 1000000000;
    buffer->timestamp.tv_usec = stamp % 1000000000 / 1000;
    buffer->length = ROOM;
    return 0;
}

static int answer(struct device *device, unsigned long request, void *what) {
    switch (request) {
    case VIDIOC_QUERYCAP: {
        struct v4l2_capability *found = what;
        memset(found, 0, sizeof *found);
        found->device_caps = is("blind") ? V4L2_CAP_META_CAPTURE : V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
        found->capabilities = V4L2_CAP_DEVICE_CAPS | V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
        return 0;
    }
    case VIDIOC_S_FMT: {
        struct v4l2_format *format = what;
        if (format->type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return failed(EINVAL);
        if (is("yuyv")) format->fmt.pix.pixelformat = V4L2_PIX_FMT_YUYV;
        if (format->fmt.pix.pixelformat != V4L2_PIX_FMT_MJPEG && !is("yuyv")) return failed(EINVAL);
        if (is("large")) format->fmt.pix.width *= 2;
        format->fmt.pix.sizeimage = ROOM;
        return 0;
    }
    case VIDIOC_S_PARM: {
        struct v4l2_streamparm *parameters = what;
        struct v4l2_fract each = parameters->parm.capture.timeperframe;
        if (parameters->type != V4L2_BUF_TYPE_VIDEO_CAPTURE || !each.denominator) return failed(EINVAL);
        device->period_ns = 1000000000LL * each.numerator / each.denominator;
        return 0;
    }
    case VIDIOC_REQBUFS: {
        struct v4l2_requestbuffers *wanted = what;
        if (wanted->memory != V4L2_MEMORY_MMAP) return failed(EINVAL);
        if (wanted->count > BUFFERS) wanted->count = BUFFERS;
        return 0;
    }
    case VIDIOC_QUERYBUF: {
        struct v4l2_buffer *buffer = what;
        if (buffer->index >= BUFFERS) return failed(EINVAL);
        buffer->length = ROOM;
        buffer->m.offset = buffer->index * ROOM;
        return 0;
    }
    case VIDIOC_QBUF: {
        struct v4l2_buffer *buffer = what;
        if (buffer->index >= BUFFERS || device->waiting == BUFFERS) return failed(EINVAL);
        device->queue[(device->first + device->waiting++) % BUFFERS] = buffer->index;
        return 0;
    }
    case VIDIOC_DQBUF:
        return hand_over(device, what);
    case VIDIOC_STREAMON:
        device->begin_ns = now_ns();
        device->on = 1;
        return 0;
    case VIDIOC_STREAMOFF:
        device->on = 0;
        return 0;
    }
    return failed(ENOTTY);
}

int ioctl(int fd, unsigned long request, ...) {
    va_list more;
    va_start(more, request);
    void *what = va_arg(more, void *);
    va_end(more);
    struct device *device = device_of(fd);
    if (device) return answer(device, request, what);
    int (*real)(int, unsigned long, ...) = (int (*)(int, unsigned long, ...))dlsym(RTLD_NEXT, "ioctl");
    return real(fd, request, what);
}
