// Times MRPT's occupancy grid on readings at known poses, as the example `known_poses` times ours.
//   mrpt_grid sonar|laser FILE REPEATS OUT.pgm
// Lines of FILE: x y heading range...; sonar: one cone of 25 degrees and 6 m; laser: 180 degrees, up to 50 m.
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationRange.h>
#include <mrpt/poses/CPose3D.h>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

struct Row { double x, y, heading; std::vector<float> ranges; };

static double cpu_ms() {
  timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return t.tv_sec * 1e3 + t.tv_nsec * 1e-6;
}

int main(int argc, char** argv) {
  if (argc < 5) { std::fprintf(stderr, "mrpt_grid sonar|laser FILE REPEATS OUT.pgm\n"); return 1; }
  const bool sonar = std::string(argv[1]) == "sonar";
  std::vector<Row> rows; std::ifstream file(argv[2]); std::string line;
  while (std::getline(file, line)) {
    std::istringstream in(line); Row row; in >> row.x >> row.y >> row.heading;
    for (float range; in >> range;) row.ranges.push_back(range);
    rows.push_back(row);
  }
  const double resolution = sonar ? 0.1 : 0.05, beam = 25 * M_PI / 180, farthest = sonar ? 6 : 50;
  double x0 = 0, y0 = 0, x1 = 45, y1 = 35, margin = sonar ? 8 : 0;
  if (!sonar) {
    x0 = y0 = 1e9; x1 = y1 = -1e9;
    for (auto& row : rows) { const int n = row.ranges.size(); const double step = M_PI / (n % 2 ? n - 1 : n);
      for (int k = 0; k < n; ++k) if (row.ranges[k] < farthest) {
        const double a = row.heading - M_PI / 2 + k * step, x = row.x + row.ranges[k] * cos(a), y = row.y + row.ranges[k] * sin(a);
        x0 = std::min(x0, x - 2); x1 = std::max(x1, x + 2); y0 = std::min(y0, y - 2); y1 = std::max(y1, y + 2); } }
  }
  std::vector<mrpt::obs::CObservationRange> cones; std::vector<mrpt::obs::CObservation2DRangeScan> scans;
  std::vector<mrpt::poses::CPose3D> poses; size_t readings = 0;
  for (auto& row : rows) {
    // MRPT lays a cone from heading - aperture to heading; turned back, it lies where the sonar looks.
    poses.emplace_back(row.x, row.y, 0, row.heading + (sonar ? beam / 2 : 0), 0, 0);
    readings += row.ranges.size();
    if (sonar) {
      mrpt::obs::CObservationRange o; o.minSensorDistance = 0; o.maxSensorDistance = farthest; o.sensorConeApperture = beam;
      o.sensedData.resize(1); o.sensedData[0].sensedDistance = row.ranges[0]; cones.push_back(o);
    } else {
      mrpt::obs::CObservation2DRangeScan o; const int n = row.ranges.size(); const double step = M_PI / (n % 2 ? n - 1 : n);
      o.aperture = (n - 1) * step; o.rightToLeft = true; o.maxRange = farthest;
      o.sensorPose = mrpt::poses::CPose3D(0, 0, 0, n % 2 ? 0 : -step / 2, 0, 0); o.resizeScan(n);
      for (int k = 0; k < n; ++k) { o.setScanRange(k, row.ranges[k]); o.setScanRangeValidity(k, row.ranges[k] < farthest); }
      scans.push_back(o);
    }
  }
  std::vector<double> times, whole; std::vector<unsigned char> image; const int w = 450, h = 350;
  for (int repeat = 0; repeat < std::atoi(argv[3]); ++repeat) {
    const double before = cpu_ms();  // its grid is laid out, and its memory touched, ahead of the readings
    mrpt::maps::COccupancyGridMap2D map(x0 - margin, x1 + margin, y0 - margin, y1 + margin, resolution);
    map.insertionOptions.maxDistanceInsertion = farthest; map.insertionOptions.considerInvalidRangesAsFreeSpace = false;
    const double start = cpu_ms();
    for (size_t k = 0; k < rows.size(); ++k) if (sonar) map.insertObservation(cones[k], poses[k]); else map.insertObservation(scans[k], poses[k]);
    times.push_back(cpu_ms() - start); whole.push_back(cpu_ms() - before);
    image.assign(w * h, 205);
    for (int r = 0; r < h; ++r) for (int c = 0; c < w; ++c) { const float q = map.getPos((c + .5) * resolution, (r + .5) * resolution);
      if (std::fabs(q - 0.5f) > 1e-3) image[(h - 1 - r) * w + c] = std::lround(254 * q); }
  }
  std::sort(times.begin(), times.end()); std::sort(whole.begin(), whole.end());
  const double ms = times[times.size() / 2], with_map = whole[whole.size() / 2];
  std::FILE* out = std::fopen(argv[4], "wb");
  if (sonar && out) { std::fprintf(out, "P5\n%d %d\n255\n", w, h); std::fwrite(image.data(), 1, image.size(), out); }
  if (out) std::fclose(out);
  std::printf("{\"peer\":\"mrpt\",\"kind\":\"%s\",\"readings\":%zu,\"ms\":%.3f,\"ns_per_reading\":%.1f,\"ms_with_its_grid\":%.3f}\n",
              argv[1], readings, ms, ms * 1e6 / readings, with_map);
}
