// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/commands/commands.h"
#include "tools/commands/simulate_stream.h"
#include "tools/common/errors.h"
#include "tools/common/text_file.h"
#include "tools/simulate/stream/recorder.h"
#include "tools/simulate/world/world_file.h"

namespace farpoint::tools {
namespace {

struct SimulateOptions {
  std::string world, output, camera_file, size, format = "grey", pictures;
  std::optional<std::int64_t> seed;
  std::optional<double> duration_s;
  bool stereo = false;
  std::int64_t every = 50;
  bool streams = false;
  StreamRequest stream;
};

void parse_size(const std::string& text, simulate::SimulationRequest* request) {
  constexpr int kMinSide_px = 32, kMaxSide_px = 4096;
  int width = 0, height = 0;
  char rest = 0;
  const int fields = std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest);
  if (fields != 2 || width < kMinSide_px || height < kMinSide_px || width > kMaxSide_px ||
      height > kMaxSide_px) {
    throw InputError("--size '" + text + "': expected WIDTHxHEIGHT of 32 to 4096 pixels each, like 1241x376");
  }
  request->width_px = width;
  request->height_px = height;
}

simulate::SimulationRequest to_request(const SimulateOptions& options) {
  const std::filesystem::path file = simulate::find_world(options.world);
  simulate::SimulationRequest request;
  request.world_name = file.stem().string();
  request.world_file = file.string();
  request.world_text = read_file(file);
  if (!options.camera_file.empty()) {
    request.camera_file = options.camera_file;
    request.camera_text = read_file(options.camera_file);
  }
  if (options.seed) request.seed = static_cast<std::uint64_t>(*options.seed);
  request.duration_s = options.duration_s;
  if (!options.size.empty()) parse_size(options.size, &request);
  request.stereo = options.stereo;
  return request;
}

int stream_simulation(const SimulateOptions& options) {
  if (options.format != "grey" || !options.pictures.empty())
    throw InputError("--format mjpeg and --pictures: expected without --stream");
  StreamRequest request = options.stream;
  request.output = options.output;
  check(request, options.stereo);
  simulate::Simulation simulation(to_request(options));
  run_stream(request, &simulation);
  return kExitDone;
}

int record_simulation(const SimulateOptions& options) {
  if (options.output.empty())
    throw InputError("simulate: expected -o with a log to write, or --stream (see farpoint simulate --help)");
  simulate::RecorderOptions recorder;
  recorder.output = options.output;
  recorder.format = options.format == "mjpeg" ? simulate::ImageFormat::kMjpeg : simulate::ImageFormat::kGrey;
  if (!options.pictures.empty()) {
    std::error_code error;
    std::filesystem::create_directories(options.pictures, error);
    if (!std::filesystem::is_directory(options.pictures))
      throw InputError("--pictures " + options.pictures + ": cannot be made (" + error.message() +
                       "), expected a folder");
    recorder.picture_folder = options.pictures;
    recorder.picture_every = options.every;
  }
  simulate::Simulation simulation(to_request(options));
  const simulate::RecorderResult result = simulate::record(&simulation, recorder);
  const slam::Camera& camera = simulation.camera(0);
  // Standard output may be the log.
  std::fprintf(
      options.output == "-" ? stderr : stdout,
      "%s: world %s, seed %llu, %lld frames of %dx%d%s, %.1f s, path %.1f m; %.1f ms of CPU a frame\n",
      options.output.c_str(), simulation.description().name.c_str(),
      static_cast<unsigned long long>(simulation.seed()), static_cast<long long>(result.frames),
      camera.width_px(), camera.height_px(), options.stereo ? " (stereo)" : "", result.simulated_s,
      result.path_m, 1e3 * result.cpu_s / static_cast<double>(result.frames));
  return kExitDone;
}

int run_simulate(const SimulateOptions& options) {
  return options.streams ? stream_simulation(options) : record_simulation(options);
}

// All of them need --stream.
void add_stream_options(CLI::App* command, SimulateOptions* options) {
  CLI::Option* stream = command->add_flag("--stream", options->streams,
                                          "Send in real time what the sensors say, instead of only a log");
  StreamRequest& request = options->stream;
  const std::vector<CLI::Option*> needing = {
      command
          ->add_option(
              "--video", request.video,
              "Images as GREY into this V4L2 output device (v4l2loopback), each stamped with the time at "
              "which it was due")
          ->type_name("DEVICE"),
      command
          ->add_option("--second-video", request.second_video, "The same for the second camera of --stereo")
          ->type_name("DEVICE"),
      command
          ->add_option("--lcm-url", request.lcm_url,
                       "CALIBRATION (each second), IMU, WHEELS and GROUND_TRUTH over the network; without "
                       "URL: one host")
          ->type_name("[URL]")
          ->expected(0, 1),
      command->add_option("--can", request.can_interface, "Wheel speeds on this SocketCAN interface")
          ->type_name("IFACE"),
      command->add_option("--wheels-dbc", request.wheels_dbc, "With --can: DBC file of the vehicle")
          ->type_name("FILE"),
      command
          ->add_option("--wheel-signals", request.wheel_signals,
                       "With --can: MESSAGE.SIGNAL,... of front left, front right, rear left, rear right; as "
                       "can.wheel_signals of farpointd")
          ->type_name("NAMES"),
      command
          ->add_option("--pace", request.pace,
                       "N times as fast as real time (default 1): slow or fast motion, speeds and turn "
                       "rates are "
                       "not changed by it")
          ->check(CLI::Range(0.01, 100.0))};
  for (CLI::Option* option : needing) option->needs(stream);
}

}  // namespace

void add_simulate_command(CLI::App* app, Action* action) {
  const auto options = std::make_shared<SimulateOptions>();
  CLI::App* command =
      app->add_subcommand("simulate", "Make a recording of a simulated world, with exact truth");
  command
      ->add_option("WORLD", options->world,
                   "A world file, or the name of one in config/worlds: town, highway, ...")
      ->required();
  command->add_option(
      "-o,--output", options->output,
      "LCM log to write; an existing one is replaced; '-' is standard output. With --stream it may be "
      "left out, and holds what was streamed, with the times of the stream");
  command
      ->add_option("--seed", options->seed,
                   "Another seed is another world of the same kind (default: the file's)")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 53));
  command->add_option("--duration", options->duration_s, "Seconds (default: the file's)")
      ->check(CLI::Range(0.05, 1e6));
  command->add_option("--camera", options->camera_file,
                      "Camera file, as in config/cameras (default: the world's camera)");
  command->add_flag("--stereo", options->stereo, "A second camera, CAMERA_1, to the right of the first");
  command->add_option("--size", options->size,
                      "WIDTHxHEIGHT in pixels, with the same lens (default: the camera's)");
  command->add_option("--format", options->format, "Of the images: grey (default) or mjpeg")
      ->check(CLI::IsMember({"grey", "mjpeg"}));
  CLI::Option* pictures =
      command->add_option("--pictures", options->pictures, "Folder for some images as PNG files; it is made");
  command->add_option("--every", options->every, "With --pictures: one picture every N frames (default 50)")
      ->needs(pictures)
      ->check(CLI::Range(1, 1000000));
  add_stream_options(command, options.get());
  command->footer(
      "The log holds CALIBRATION, SIMULATION (what made it), IMU, WHEELS, GROUND_TRUTH and CAMERA_N. The "
      "same seed "
      "gives\n"
      "the same bytes. A run that ends early leaves what it has as OUTPUT.incomplete, which replays.\n"
      "--stream: stamps of images and utime of messages are of CLOCK_MONOTONIC, as farpointd's are, so that "
      "truth can "
      "be\n"
      "compared with what it publishes live. Images are rendered ahead; those that go out more than 2 ms "
      "after their "
      "time are\n"
      "counted as late, and the last line says how much of the pace was reached. Ctrl-C and SIGTERM end it "
      "in order.\n"
      "Examples:\n"
      "  farpoint simulate town -o town.lcm --duration 60\n"
      "  farpoint simulate endless -o - --duration 2000 --size 320x240 | farpointd --replay - --lockstep "
      "--output out.lcm\n"
      "  farpoint simulate my_world.yaml -o run.lcm --seed 3 --stereo --pictures . --every 100\n"
      "  farpoint simulate town --stream --video /dev/video10 --lcm-url --can vcan0 --wheels-dbc car.dbc \\\n"
      "      --wheel-signals FRONT.LEFT,FRONT.RIGHT,REAR.LEFT,REAR.RIGHT       (modprobe v4l2loopback "
      "video_nr=10)");
  command->callback([=] { *action = [=] { return run_simulate(*options); }; });
}

}  // namespace farpoint::tools
