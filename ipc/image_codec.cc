// SPDX-License-Identifier: Apache-2.0
#include "ipc/image_codec.h"

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstring>

#include <jpeglib.h>
// After jpeglib.h, which it needs.
#include <jerror.h>
#include <png.h>

namespace farpoint::ipc {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr int kMaxJpegScans = 100;  // more only make a decoder busy
// Largest chunk of a PNG file except its pixels, and largest colour profile.
constexpr png_alloc_size_t kMaxPngChunkBytes = png_alloc_size_t{1} << 20;

std::uint32_t big_endian_16(const std::uint8_t* p) {
  return std::uint32_t{p[0]} << 8 | p[1];
}
std::uint32_t big_endian_32(const std::uint8_t* p) {
  return big_endian_16(p) << 16 | big_endian_16(p + 2);
}

bool is_possible_size(std::int64_t width_px, std::int64_t height_px) {
  return width_px > 0 && height_px > 0 && width_px <= kMaxImageSide_px && height_px <= kMaxImageSide_px;
}

// Empty where an image of this size is decoded.
std::optional<ImageStatus> refuse_size(int width_px, int height_px, std::int64_t most_pixels) {
  if (!is_possible_size(width_px, height_px)) return ImageStatus::kWrongSize;
  if (std::int64_t{width_px} * height_px > most_pixels) return ImageStatus::kTooLarge;
  return std::nullopt;
}

void set_size(GreyImage* image, int width_px, int height_px) {
  image->width_px = width_px;
  image->height_px = height_px;
  image->pixels.resize(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
}

// The message's bytes: never more than it holds.
Bytes payload(const image_t& message) {
  if (message.size <= 0) return {};
  const Bytes data(message.data);
  return data.first(std::min(data.size(), static_cast<std::size_t>(message.size)));
}

ImageStatus copy_grey(const image_t& message, GreyImage* image) {
  const std::int64_t stride = message.row_stride == 0 ? message.width : message.row_stride;
  if (!is_possible_size(message.width, message.height) || stride < message.width)
    return ImageStatus::kWrongSize;
  const std::int64_t needed = stride * (message.height - 1) + message.width;
  const Bytes data = payload(message);
  if (static_cast<std::int64_t>(data.size()) < needed) return ImageStatus::kWrongSize;
  set_size(image, message.width, message.height);
  const auto width = static_cast<std::size_t>(message.width);
  for (std::size_t row = 0; row < static_cast<std::size_t>(message.height); ++row) {
    std::memcpy(image->pixels.data() + row * width, data.data() + row * static_cast<std::size_t>(stride),
                width);
  }
  return ImageStatus::kOk;
}

// ---- PNG ----

struct PngReader {
  Bytes rest;
};

void read_png_bytes(png_structp png, png_bytep out, std::size_t bytes) {
  auto* reader = static_cast<PngReader*>(png_get_io_ptr(png));
  if (bytes > reader->rest.size()) png_error(png, "cut off");
  std::memcpy(out, reader->rest.data(), bytes);
  reader->rest = reader->rest.subspan(bytes);
}

[[noreturn]] void leave_png(png_structp png, png_const_charp) {
  png_longjmp(png, 1);
}
void ignore_png_warning(png_structp, png_const_charp) {}

// Text, however small it is compressed, and chunks without a meaning for pixels are passed over; a profile
// has a limit. Each would be inflated in memory else.
void bound_ancillary_chunks(png_structp png) {
  constexpr png_uint_32 kSkipAll = 1;
  png_set_chunk_cache_max(png, kSkipAll);
  png_set_chunk_malloc_max(png, kMaxPngChunkBytes);
  png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, 0);
}

// Everything becomes 8-bit grey without alpha.
void ask_for_grey(png_structp png, png_infop info) {
  const int type = png_get_color_type(png, info);
  if (png_get_bit_depth(png, info) == 16) png_set_scale_16(png);
  if (type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
  if (type == PNG_COLOR_TYPE_GRAY && png_get_bit_depth(png, info) < 8) png_set_expand_gray_1_2_4_to_8(png);
  if ((type & PNG_COLOR_MASK_COLOR) != 0) {
    png_set_rgb_to_gray_fixed(png, PNG_ERROR_ACTION_NONE, PNG_RGB_TO_GRAY_DEFAULT, PNG_RGB_TO_GRAY_DEFAULT);
  }
  png_set_strip_alpha(png);
}

png_voidp allocate_for_png(png_structp png, png_alloc_size_t bytes) {
  return static_cast<DecodeArena*>(png_get_mem_ptr(png))->allocate(bytes);
}
void free_with_the_image(png_structp, png_voidp) {}

// No object with a destructor may live here: libpng leaves by longjmp.
ImageStatus decode_png(const image_t& message, DecodeArena* arena, GreyImage* image) {
  PngReader reader{payload(message)};
  arena->reset(ImageDecoder::kMaxWorkingBytes);
  png_structp png = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, nullptr, leave_png, ignore_png_warning,
                                             arena, allocate_for_png, free_with_the_image);
  if (png == nullptr) return ImageStatus::kDamaged;
  png_infop info = png_create_info_struct(png);
  volatile ImageStatus status = ImageStatus::kDamaged;
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_read_struct(&png, &info, nullptr);
    return arena->has_refused() ? ImageStatus::kTooLarge : ImageStatus::kDamaged;
  }
  png_set_user_limits(png, kMaxImageSide_px, kMaxImageSide_px);
  bound_ancillary_chunks(png);
  png_set_read_fn(png, &reader, read_png_bytes);
  png_read_info(png, info);
  const auto width_px = static_cast<int>(png_get_image_width(png, info));
  const auto height_px = static_cast<int>(png_get_image_height(png, info));
  if (width_px != message.width || height_px != message.height) {
    status = ImageStatus::kWrongSize;
  } else {
    ask_for_grey(png, info);
    const int passes = png_set_interlace_handling(png);
    png_read_update_info(png, info);
    if (png_get_rowbytes(png, info) == static_cast<std::size_t>(width_px)) {
      set_size(image, width_px, height_px);
      for (int pass = 0; pass < passes; ++pass) {
        for (int row = 0; row < height_px; ++row) {
          png_read_row(png, image->pixels.data() + static_cast<std::ptrdiff_t>(row) * width_px, nullptr);
        }
      }
      png_read_end(png, nullptr);
      status = ImageStatus::kOk;
    }
  }
  png_destroy_read_struct(&png, &info, nullptr);
  return status;
}

std::optional<ImageInfo> probe_png(Bytes file) {
  constexpr std::size_t kHeadBytes = 24;  // signature, length and name of IHDR, width, height
  static constexpr std::uint8_t kSignature[] = {0x89, 'P', 'N', 'G', 0x0d, 0x0a, 0x1a, 0x0a};
  if (file.size() < kHeadBytes || std::memcmp(file.data(), kSignature, sizeof kSignature) != 0) return {};
  if (std::memcmp(file.data() + 12, "IHDR", 4) != 0) return {};
  const std::uint32_t width_px = big_endian_32(file.data() + 16), height_px = big_endian_32(file.data() + 20);
  if (!is_possible_size(width_px, height_px)) return {};
  return ImageInfo{image_t::PIXEL_FORMAT_PNG, static_cast<int>(width_px), static_cast<int>(height_px)};
}

// ---- JPEG ----

// Markers SOF0..SOF15 hold the size; C4, C8 and CC among these numbers are others.
bool is_start_of_frame(std::uint8_t marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

std::optional<ImageInfo> probe_jpeg(Bytes file) {
  if (file.size() < 4 || file[0] != 0xff || file[1] != 0xd8) return {};
  std::size_t at = 2;
  while (at + 9 <= file.size() && file[at] == 0xff) {
    const std::uint8_t marker = file[at + 1];
    if (marker == 0xff) {  // fill byte
      ++at;
      continue;
    }
    if (is_start_of_frame(marker)) {
      const std::uint32_t height_px = big_endian_16(&file[at + 5]), width_px = big_endian_16(&file[at + 7]);
      if (!is_possible_size(width_px, height_px)) return {};
      return ImageInfo{image_t::PIXEL_FORMAT_MJPEG, static_cast<int>(width_px), static_cast<int>(height_px)};
    }
    at += 2 + std::max<std::size_t>(big_endian_16(&file[at + 2]), 2);
  }
  return {};
}

}  // namespace

// libjpeg's state, its way out of an error, and what it complained about.
struct ImageDecoder::Jpeg {
  jpeg_decompress_struct decoder{};
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  std::jmp_buf way_out{};
  bool damaged = false;
  bool too_large = false;  // as a whole, for the library's own memory
  DecodeArena* arena = nullptr;
  jpeg_memory_mgr library{};  // libjpeg's own memory functions

  static Jpeg* of(j_common_ptr common) { return static_cast<Jpeg*>(common->client_data); }

  [[noreturn]] static void leave(j_common_ptr common) {
    of(common)->too_large = common->err->msg_code == JERR_NO_BACKING_STORE;
    std::longjmp(of(common)->way_out, 1);
  }
  static void print_nothing(j_common_ptr) {}
  // libjpeg fills what it cannot decode with grey and only warns; a tracker must not see that.
  static void note_warning(j_common_ptr common, int level) {
    const int code = common->err->msg_code;
    const bool harmless = code == JWRN_EXTRANEOUS_DATA || code == JWRN_ADOBE_XFORM || code == JWRN_BOGUS_ICC;
    if (level < 0 && !harmless) of(common)->damaged = true;
  }
  static void limit_scans(j_common_ptr common) {
    if (reinterpret_cast<j_decompress_ptr>(common)->input_scan_number > kMaxJpegScans) leave(common);
  }

  // What belongs to one image comes from the arena, what stays from libjpeg.
  static void* allocate(j_common_ptr common, int pool, std::size_t bytes) {
    if (pool != JPOOL_IMAGE) return of(common)->library.alloc_small(common, pool, bytes);
    void* piece = of(common)->arena->allocate(bytes);
    if (piece == nullptr) leave(common);
    return piece;
  }
  template <typename Row>
  static Row* allocate_rows(j_common_ptr common, std::size_t row_bytes, JDIMENSION rows) {
    // Rows of whole alignment units, two of them where SIMD writes beyond the end.
    constexpr std::size_t kUnit = 2 * DecodeArena::kAlignment;
    row_bytes = (row_bytes + kUnit - 1) / kUnit * kUnit;
    auto* row = static_cast<Row*>(allocate(common, JPOOL_IMAGE, rows * sizeof(Row)));
    auto* bytes = static_cast<std::uint8_t*>(allocate(common, JPOOL_IMAGE, rows * row_bytes));
    for (JDIMENSION i = 0; i < rows; ++i) row[i] = reinterpret_cast<Row>(bytes + i * row_bytes);
    return row;
  }
  static JSAMPARRAY allocate_samples(j_common_ptr common, int pool, JDIMENSION width, JDIMENSION rows) {
    if (pool != JPOOL_IMAGE) return of(common)->library.alloc_sarray(common, pool, width, rows);
    return allocate_rows<JSAMPROW>(common, width * sizeof(JSAMPLE), rows);
  }
  static JBLOCKARRAY allocate_blocks(j_common_ptr common, int pool, JDIMENSION width, JDIMENSION rows) {
    if (pool != JPOOL_IMAGE) return of(common)->library.alloc_barray(common, pool, width, rows);
    return allocate_rows<JBLOCKROW>(common, width * sizeof(JBLOCK), rows);
  }
  static void free_pool(j_common_ptr common, int pool) {
    of(common)->library.free_pool(common, pool);
    if (pool == JPOOL_IMAGE) of(common)->arena->reset();
  }
  void use_arena(DecodeArena* memory) {
    arena = memory;
    library = *decoder.mem;
    decoder.mem->alloc_small = allocate;
    decoder.mem->alloc_large = allocate;
    decoder.mem->alloc_sarray = allocate_samples;
    decoder.mem->alloc_barray = allocate_blocks;
    decoder.mem->free_pool = free_pool;
  }

  Jpeg() {
    decoder.err = jpeg_std_error(&errors);
    errors.error_exit = leave;
    errors.output_message = print_nothing;
    errors.emit_message = note_warning;
    progress.progress_monitor = limit_scans;
    decoder.client_data = this;
  }
  ~Jpeg() { jpeg_destroy_decompress(&decoder); }

  ImageStatus decode(Bytes file, int expected_width_px, int expected_height_px, GreyImage* image);
};

// No object with a destructor may live here: libjpeg leaves by longjmp.
ImageStatus ImageDecoder::Jpeg::decode(Bytes file, int expected_width_px, int expected_height_px,
                                       GreyImage* image) {
  damaged = too_large = false;
  errors.msg_code = 0;
  if (setjmp(way_out) != 0) {
    too_large = too_large || arena->has_refused();
    jpeg_abort_decompress(&decoder);
    return too_large ? ImageStatus::kTooLarge : ImageStatus::kDamaged;
  }
  arena->reset(kMaxWorkingBytes);
  const std::int64_t pixels = std::int64_t{expected_width_px} * expected_height_px;
  decoder.mem->max_memory_to_use =
      static_cast<long>(kMaxWorkingBytes + kMaxBytesAPixel * static_cast<std::size_t>(pixels));
  jpeg_mem_src(&decoder, file.data(), static_cast<unsigned long>(file.size()));
  decoder.progress = &progress;
  jpeg_read_header(&decoder, TRUE);
  const auto width_px = static_cast<int>(decoder.image_width),
             height_px = static_cast<int>(decoder.image_height);
  if (width_px != expected_width_px || height_px != expected_height_px ||
      !is_possible_size(width_px, height_px)) {
    jpeg_abort_decompress(&decoder);
    return ImageStatus::kWrongSize;
  }
  decoder.out_color_space = JCS_GRAYSCALE;
  jpeg_start_decompress(&decoder);
  set_size(image, width_px, height_px);
  while (decoder.output_scanline < decoder.output_height) {
    JSAMPROW row = image->pixels.data() + static_cast<std::ptrdiff_t>(decoder.output_scanline) * width_px;
    jpeg_read_scanlines(&decoder, &row, 1);
  }
  jpeg_finish_decompress(&decoder);
  return damaged ? ImageStatus::kDamaged : ImageStatus::kOk;
}

const char* to_string(ImageStatus status) {
  switch (status) {
    case ImageStatus::kOk:
      return "ok";
    case ImageStatus::kWrongSize:
      return "wrong size";
    case ImageStatus::kUnknownFormat:
      return "unknown pixel format";
    case ImageStatus::kDamaged:
      return "damaged";
    case ImageStatus::kTooLarge:
      return "too large";
  }
  return "?";
}

std::optional<ImageInfo> probe_image(Bytes file) {
  if (const auto png = probe_png(file)) return png;
  return probe_jpeg(file);
}

ImageDecoder::ImageDecoder(std::int64_t most_pixels)
    : most_pixels_(most_pixels), jpeg_(std::make_unique<Jpeg>()) {
  // Creation can only fail for memory or a mismatch of library versions: both leave through the error
  // handler.
  if (setjmp(jpeg_->way_out) != 0) throw std::bad_alloc();
  jpeg_create_decompress(&jpeg_->decoder);
  jpeg_->decoder.client_data = jpeg_.get();
  jpeg_->use_arena(&arena_);
}

ImageDecoder::~ImageDecoder() = default;

ImageStatus ImageDecoder::decode_jpeg(Bytes file, int width_px, int height_px, GreyImage* image) {
  if (const auto refused = refuse_size(width_px, height_px, most_pixels_)) return *refused;
  return file.empty() ? ImageStatus::kDamaged : jpeg_->decode(file, width_px, height_px, image);
}

ImageStatus ImageDecoder::decode(const image_t& message, GreyImage* image) {
  if (const auto refused = refuse_size(message.width, message.height, most_pixels_)) return *refused;
  switch (message.pixel_format) {
    case image_t::PIXEL_FORMAT_GREY:
      return copy_grey(message, image);
    case image_t::PIXEL_FORMAT_MJPEG:
      return decode_jpeg(payload(message), message.width, message.height, image);
    case image_t::PIXEL_FORMAT_PNG:
      return decode_png(message, &arena_, image);
    default:
      return ImageStatus::kUnknownFormat;
  }
}

}  // namespace farpoint::ipc
