// SPDX-License-Identifier: Apache-2.0
// usage: usb_camera WIDTHxHEIGHT RATE FRAMES_FILE [COUNT]
//
// Emulates a USB video class camera on the kernel's virtual host controller (vhci-hcd, USB/IP), so that the
// kernel's own uvcvideo makes the device. Sends the raw grey frames of the file over a bulk end point,
// forwards and backwards in turn, and prints "NUMBER INDEX_IN_FILE MONOTONIC_US" when one begins to be sent.
// SIGUSR1 makes it fall silent, without an error, until the next. Its end, also by a signal, is an
// unplugging.
#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define VHCI "/sys/devices/platform/vhci_hcd.0/"
#define LE16(x) (uint8_t)(x), (uint8_t)((x) >> 8)
#define LE32(x) LE16(x), (uint8_t)((x) >> 16), (uint8_t)((uint32_t)(x) >> 24)

enum { kPayload = 16384, kHeader = 2, kPending = 256, kMaxTransfer = 1 << 16 };
// USB/IP.
enum { kSubmit = 1, kUnlink = 2, kReturnSubmit = 3, kReturnUnlink = 4, kUsbIpHeader = 48 };
enum { kStall = -32, kUnlinked = -104 };
// USB and UVC requests.
enum { kGetDescriptor = 6, kGetConfiguration = 8, kGetInterface = 10, kClearFeature = 1 };
enum { kUvcSetCur = 1, kUvcGetLen = 0x85, kUvcGetInfo = 0x86, kProbe = 1, kCommit = 2, kProbeBytes = 26 };

struct camera {
  int socket;
  uint32_t width, height, interval_100ns;
  const uint8_t* frames;
  long count, limit;
  int streaming;
  uint8_t configuration[512];
  int configuration_bytes;
  // Bulk transfers that wait for data, oldest first.
  uint32_t pending[kPending], pending_bytes[kPending];
  int pendings;
  // The frame that is being sent.
  long number;
  int64_t at;  // bytes of it that are gone; -1: none is
  int toggle;
  int64_t next_us;
};

static volatile sig_atomic_t stopped, silent;
static void on_signal(int number) {
  if (number == SIGUSR1)
    silent = !silent;
  else
    stopped = 1;
}

static int64_t now_us(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

static uint32_t frame_bytes(const struct camera* c) {
  return c->width * c->height;
}

// --- descriptors

static int append(struct camera* c, const uint8_t* bytes, size_t size) {
  const int at = c->configuration_bytes;
  memcpy(c->configuration + at, bytes, size);
  c->configuration_bytes += (int)size;
  return at;
}
#define APPEND(c, ...) append(c, (const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__}))

static void set_length(struct camera* c, int at, int length) {
  c->configuration[at] = (uint8_t)length;
  c->configuration[at + 1] = (uint8_t)(length >> 8);
}

// Video control: camera terminal -> USB streaming terminal.
static void describe_control(struct camera* c) {
  APPEND(c, 9, 4, 0, 0, 0, 0x0e, 1, 0, 0);
  const int begin = APPEND(c, 13, 0x24, 1, LE16(0x0100), 0, 0, LE32(48000000), 1, 1);
  APPEND(c, 17, 0x24, 2, 1, LE16(0x0201), 0, 0, LE16(0), LE16(0), LE16(0), 2, 0, 0);
  APPEND(c, 9, 0x24, 3, 2, LE16(0x0101), 0, 1, 0);
  set_length(c, begin + 5, c->configuration_bytes - begin);
}

// Video streaming: one format, 8 bit grey, of one size and rate.
static void describe_streaming(struct camera* c) {
  const uint32_t bytes = frame_bytes(c), bits_a_second = (uint32_t)(8.0 * bytes * 1e7 / c->interval_100ns);
  APPEND(c, 9, 4, 1, 0, 1, 0x0e, 2, 0, 0);
  const int begin = APPEND(c, 14, 0x24, 1, 1, 0, 0, 0x81, 0, 2, 0, 0, 0, 1, 0);
  APPEND(c, 27, 0x24, 4, 1, 1, 'Y', '8', '0', '0', 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71, 8, 1,
         0, 0, 0, 0);
  APPEND(c, 30, 0x24, 5, 1, 0, LE16(c->width), LE16(c->height), LE32(bits_a_second), LE32(bits_a_second),
         LE32(bytes), LE32(c->interval_100ns), 1, LE32(c->interval_100ns));
  APPEND(c, 6, 0x24, 0x0d, 1, 1, 4);
  set_length(c, begin + 4, c->configuration_bytes - begin);
  APPEND(c, 7, 5, 0x81, 2, LE16(512), 0);
}

static void describe(struct camera* c) {
  APPEND(c, 9, 2, 0, 0, 2, 1, 0, 0x80, 250);
  APPEND(c, 8, 0x0b, 0, 2, 0x0e, 3, 0, 0);
  describe_control(c);
  describe_streaming(c);
  set_length(c, 2, c->configuration_bytes);
}

// --- USB/IP

static int read_all(struct camera* c, void* bytes, size_t size) {
  for (size_t got = 0; got < size;) {
    const ssize_t n = read(c->socket, (char*)bytes + got, size - got);
    if (n <= 0) return 0;
    got += (size_t)n;
  }
  return 1;
}

static void write_all(struct camera* c, const void* bytes, size_t size) {
  for (size_t gone = 0; gone < size;) {
    const ssize_t n = write(c->socket, (const char*)bytes + gone, size - gone);
    if (n <= 0) exit(1);
    gone += (size_t)n;
  }
}

// `actual`: bytes that were transferred; of them those of `data` are sent back.
static void answer(struct camera* c, uint32_t sequence, int status, const void* data, uint32_t size,
                   uint32_t actual) {
  static uint8_t message[kUsbIpHeader + kMaxTransfer];
  const uint32_t header[12] = {htonl(kReturnSubmit),    htonl(sequence), 0, 0, 0,
                               htonl((uint32_t)status), htonl(actual)};
  memcpy(message, header, sizeof header);
  if (size > 0) memcpy(message + sizeof header, data, size);
  write_all(c, message, sizeof header + size);
}

static uint32_t text_descriptor(const char* text, uint8_t* out) {
  const size_t length = strlen(text);
  out[0] = (uint8_t)(2 + 2 * length);
  out[1] = 3;
  for (size_t i = 0; i < length; ++i) {
    out[2 + 2 * i] = (uint8_t)text[i];
    out[3 + 2 * i] = 0;
  }
  return out[0];
}

// The descriptor's bytes; 0: there is none.
static uint32_t descriptor(struct camera* c, int value, uint8_t* out) {
  static const uint8_t device[] = {18, 1, 0, 2, 0xef, 2, 1, 64, LE16(0x1d6b), LE16(0x0102), 0, 1, 1, 2, 0, 1};
  static const uint8_t qualifier[] = {10, 6, 0, 2, 0xef, 2, 1, 64, 1, 0}, languages[] = {4, 3, 9, 4};
  switch (value >> 8) {
    case 1:
      memcpy(out, device, sizeof device);
      return sizeof device;
    case 2:
      memcpy(out, c->configuration, sizeof c->configuration);
      return (uint32_t)c->configuration_bytes;
    case 3:
      if ((value & 255) != 0) return text_descriptor((value & 255) == 1 ? "Farpoint" : "Bench camera", out);
      memcpy(out, languages, sizeof languages);
      return sizeof languages;
    case 6:
      memcpy(out, qualifier, sizeof qualifier);
      return sizeof qualifier;
    default:
      return 0;
  }
}

// What probe and commit are answered: the one format there is.
static void fill_probe(const struct camera* c, uint8_t* out) {
  const uint8_t probe[kProbeBytes] = {
      LE16(0), 1,       1,       LE32(c->interval_100ns), LE16(0),       LE16(0),
      LE16(0), LE16(0), LE16(0), LE32(frame_bytes(c)),    LE32(kPayload)};
  memcpy(out, probe, sizeof probe);
}

static void control(struct camera* c, uint32_t sequence, const uint8_t* setup, uint32_t length) {
  uint8_t out[512] = {0};
  uint32_t size = 0;
  const int type = setup[0], request = setup[1], value = setup[2] | setup[3] << 8,
            index = setup[4] | setup[5] << 8;
  const int streaming_control = (index & 255) == 1 && (value >> 8 == kProbe || value >> 8 == kCommit);
  if (type == 0x80 && request == kGetDescriptor) {
    size = descriptor(c, value, out);
    if (size == 0) return answer(c, sequence, kStall, NULL, 0, 0);
  } else if ((type & 0xe0) == 0x80) {  // standard, to the host
    out[0] = request == kGetConfiguration;
    size = request == kGetConfiguration || request == kGetInterface ? 1 : 2;
  } else if ((type & 0xe0) == 0) {  // standard, from the host
    // How a bulk stream is ended.
    if (request == kClearFeature && (type & 31) == 2) c->streaming = 0;
    return answer(c, sequence, 0, NULL, 0, 0);
  } else if (type == 0xa1) {  // class, to the host
    size = streaming_control ? kProbeBytes : 1;
    if (streaming_control && request == kUvcGetLen)
      out[0] = kProbeBytes, size = 2;
    else if (streaming_control && request == kUvcGetInfo)
      out[0] = 3, size = 1;
    else if (streaming_control)
      fill_probe(c, out);
  } else {  // class, from the host
    if (streaming_control && request == kUvcSetCur && value >> 8 == kCommit) c->streaming = 1;
    return answer(c, sequence, 0, NULL, 0, length);
  }
  size = size < length ? size : length;
  answer(c, sequence, 0, out, size, size);
}

static void drop_pending(struct camera* c, int i) {
  --c->pendings;
  memmove(c->pending + i, c->pending + i + 1, (size_t)(c->pendings - i) * sizeof *c->pending);
  memmove(c->pending_bytes + i, c->pending_bytes + i + 1,
          (size_t)(c->pendings - i) * sizeof *c->pending_bytes);
}

static void unlink_transfer(struct camera* c, uint32_t sequence, uint32_t wanted) {
  int status = 0;
  for (int i = 0; i < c->pendings && status == 0; ++i) {
    if (c->pending[i] != wanted) continue;
    drop_pending(c, i);
    status = kUnlinked;
  }
  const uint32_t header[12] = {htonl(kReturnUnlink), htonl(sequence), 0, 0, 0, htonl((uint32_t)status)};
  write_all(c, header, sizeof header);
  if (c->pendings == 0) c->at = -1;
}

static int take_request(struct camera* c) {
  static uint8_t from_host[kMaxTransfer];
  uint32_t header[12];
  if (!read_all(c, header, sizeof header)) return 0;
  const uint32_t command = ntohl(header[0]), sequence = ntohl(header[1]), to_host = ntohl(header[3]);
  const uint32_t end_point = ntohl(header[4]), length = ntohl(header[6]);
  if (command == kUnlink) {
    unlink_transfer(c, sequence, ntohl(header[5]));
  } else if (command == kSubmit) {
    if (!to_host && (length > sizeof from_host || !read_all(c, from_host, length))) return 0;
    if (end_point == 0) {
      control(c, sequence, (const uint8_t*)(header + 10), length);
    } else if (c->pendings < kPending) {
      c->pending[c->pendings] = sequence;
      c->pending_bytes[c->pendings++] = length;
    }
  }
  return 1;
}

// --- frames

static long index_in_file(const struct camera* c) {
  const long period = c->count > 1 ? 2 * (c->count - 1) : 1, at = c->number % period;
  return at < c->count ? at : period - at;
}

static void begin_frame_if_due(struct camera* c) {
  if (silent || !c->streaming || c->at >= 0 || c->pendings == 0 || now_us() < c->next_us) return;
  const int64_t period_us = c->interval_100ns / 10;
  c->next_us = c->next_us + period_us > now_us() ? c->next_us + period_us : now_us() + period_us;
  c->at = 0;
  c->toggle ^= 1;
  printf("%ld %ld %lld\n", c->number, index_in_file(c), (long long)now_us());
  fflush(stdout);
}

static void send_payload(struct camera* c) {
  static uint8_t payload[kPayload];
  const int64_t room = (c->pending_bytes[0] < kPayload ? c->pending_bytes[0] : kPayload) - kHeader;
  const int64_t left = (int64_t)frame_bytes(c) - c->at, size = left < room ? left : room;
  const int is_last = size == left;
  payload[0] = kHeader;
  payload[1] = (uint8_t)(0x80 | c->toggle | is_last << 1);
  memcpy(payload + kHeader, c->frames + (size_t)index_in_file(c) * frame_bytes(c) + c->at, (size_t)size);
  answer(c, c->pending[0], 0, payload, (uint32_t)size + kHeader, (uint32_t)size + kHeader);
  drop_pending(c, 0);
  c->at = is_last ? -1 : c->at + size;
  c->number += is_last;
}

static int wait_ms(const struct camera* c) {
  if (c->at >= 0 && c->pendings > 0) return 0;
  const int64_t left_us = c->next_us - now_us();
  return !c->streaming ? 100 : left_us > 0 ? (int)(left_us / 1000) + 1 : 1;
}

static void run(struct camera* c) {
  while (!stopped && (c->limit < 0 || c->number < c->limit)) {
    struct pollfd wait = {c->socket, POLLIN, 0};
    (void)poll(&wait, 1, wait_ms(c));
    if ((wait.revents & (POLLHUP | POLLERR)) != 0) return;
    if ((wait.revents & POLLIN) != 0 && !take_request(c)) return;
    begin_frame_if_due(c);
    if (c->at >= 0 && c->pendings > 0) send_payload(c);
  }
}

static int plug_in(struct camera* c) {
  enum { kHighSpeed = 3 };
  int sockets[2];
  char line[64];
  const int room = 1 << 20, attach = open(VHCI "attach", O_WRONLY);
  if (attach < 0 || socketpair(AF_UNIX, SOCK_STREAM, 0, sockets) != 0) return 0;
  setsockopt(sockets[0], SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
  setsockopt(sockets[1], SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
  c->socket = sockets[0];
  const int length = snprintf(line, sizeof line, "0 %d 1 %d", sockets[1], kHighSpeed);
  const int attached = write(attach, line, (size_t)length) == length;
  close(attach);
  close(sockets[1]);
  return attached;
}

static void unplug(void) {
  const int detach = open(VHCI "detach", O_WRONLY);
  if (detach < 0 || write(detach, "0", 1) != 1) perror(VHCI "detach");
}

int main(int argc, char** argv) {
  struct camera c = {.at = -1, .limit = argc > 4 ? atol(argv[4]) : -1};
  if (argc < 4 || sscanf(argv[1], "%ux%u", &c.width, &c.height) != 2 || atof(argv[2]) <= 0.0) {
    fprintf(stderr, "usage: usb_camera WIDTHxHEIGHT RATE FRAMES_FILE [COUNT]\n");
    return 2;
  }
  c.interval_100ns = (uint32_t)(1e7 / atof(argv[2]));
  const int fd = open(argv[3], O_RDONLY);
  struct stat status;
  if (fd < 0 || fstat(fd, &status) != 0) {
    perror(argv[3]);
    return 1;
  }
  c.frames = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, fd, 0);
  c.count = status.st_size / (long)frame_bytes(&c);
  signal(SIGTERM, on_signal);
  signal(SIGINT, on_signal);
  signal(SIGUSR1, on_signal);
  signal(SIGPIPE, SIG_IGN);
  describe(&c);
  if (!plug_in(&c)) {
    perror(VHCI "attach");
    return 1;
  }
  run(&c);
  unplug();
  return 0;
}
