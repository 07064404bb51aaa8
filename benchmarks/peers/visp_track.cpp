// ViSP's model-based tracker on a sequence of images of a known object, on one thread.
//
//   visp_track serve CONFIG MODEL POSE IMAGE...
//       CONFIG, MODEL, POSE: ViSP's XML, CAO and starting pose. Says which ViSP it is, then answers
//       each line `CASE STEP` (CASE: edges, or edges_points for edges and KLT; STEP: every
//       how-manieth image) with the CPU seconds per image, and for each of those images seven
//       numbers: the pose, as t and the rotation vector, and 1 if it says that it is lost, else 0.
#include <ctime>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include <visp3/core/vpConfig.h>
#include <visp3/io/vpImageIo.h>
#include <visp3/mbt/vpMbGenericTracker.h>

namespace {

using Image = vpImage<unsigned char>;
constexpr int kEdges = vpMbGenericTracker::EDGE_TRACKER;

double cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return now.tv_sec + 1e-9 * now.tv_nsec;
}

struct Task {
  std::string config, model;
  vpHomogeneousMatrix start;
  std::vector<Image> images;
};

void track(const Task &task, int kind, size_t step) {
  vpMbGenericTracker tracker;
  tracker.setTrackerType(kind);
  tracker.loadConfigFile(task.config, false);
  std::cout.setstate(std::ios::failbit); // it prints what it reads
  tracker.loadModel(task.model);
  std::cout.clear();
  tracker.setDisplayFeatures(false);
  tracker.setProjectionErrorComputation(false);
  tracker.initFromPose(task.images[0], task.start);
  std::ostringstream poses;
  poses.precision(9);
  double seconds = 0.0;
  size_t count = 0;
  for (size_t k = 0; k < task.images.size(); k += step, ++count) {
    const double before = cpu_seconds();
    bool lost = false;
    try {
      tracker.track(task.images[k]);
    } catch (const vpException &) {
      lost = true;
    }
    seconds += cpu_seconds() - before;
    vpHomogeneousMatrix pose;
    tracker.getPose(pose);
    const vpPoseVector numbers(pose);
    for (unsigned i = 0; i < 6; ++i)
      poses << ' ' << numbers[i];
    poses << ' ' << lost;
    if (lost)
      tracker.initFromPose(task.images[k], pose);
  }
  std::cout << seconds / count << poses.str() << std::endl;
}

} // namespace

int main(int argc, char **argv) {
  if (argc < 6 || std::string(argv[1]) != "serve") {
    std::cerr << "visp_track serve CONFIG MODEL POSE IMAGE..." << std::endl;
    return 2;
  }
  Task task{argv[2], argv[3], {}, {}};
  std::ifstream file(argv[4]);
  double p[6];
  for (double &number : p)
    file >> number;
  task.start = vpHomogeneousMatrix(p[0], p[1], p[2], p[3], p[4], p[5]);
  for (int i = 5; i < argc; ++i) {
    task.images.emplace_back();
    vpImageIo::read(task.images.back(), argv[i]);
  }
  std::cout.precision(9);
  std::cout << "ViSP " << VISP_VERSION_MAJOR << '.' << VISP_VERSION_MINOR << '.' << VISP_VERSION_PATCH << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string name;
    size_t step = 0;
    words >> name >> step;
    if ((name != "edges" && name != "edges_points") || step < 1)
      std::cout << "error: no case " << line << std::endl;
    else
      track(task, name == "edges" ? kEdges : kEdges | vpMbGenericTracker::KLT_TRACKER, step);
  }
}
