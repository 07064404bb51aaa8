// ViSP's detector of AprilTags 36h11, on one thread.
//
//   visp_tags serve
//       Says which ViSP it is, then answers each line, the path of an image, with nine numbers for
//       each tag: its number, and u and v of its four corners.
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include <visp3/core/vpConfig.h>
#include <visp3/detection/vpDetectorAprilTag.h>
#include <visp3/io/vpImageIo.h>

int main(int argc, char **argv) {
  if (argc != 2 || std::string(argv[1]) != "serve") {
    std::cerr << "visp_tags serve" << std::endl;
    return 2;
  }
  vpDetectorAprilTag detector(vpDetectorAprilTag::TAG_36h11);
  std::cout.precision(9);
  std::cout << "ViSP " << VISP_VERSION_MAJOR << '.' << VISP_VERSION_MINOR << '.' << VISP_VERSION_PATCH << std::endl;
  for (std::string path; std::getline(std::cin, path);) {
    vpImage<unsigned char> image;
    vpImageIo::read(image, path);
    detector.detect(image);
    const std::vector<int> ids = detector.getTagsId();
    const auto corners = detector.getTagsCorners();
    std::ostringstream said;
    said.precision(9);
    for (size_t n = 0; n < ids.size(); ++n) {
      said << ' ' << ids[n];
      for (const vpImagePoint &corner : corners[n])
        said << ' ' << corner.get_u() << ' ' << corner.get_v();
    }
    std::cout << "tags" << said.str() << std::endl;
  }
}
