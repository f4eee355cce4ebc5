#include "tests/e2e/command_line_fixture.h"

namespace penumbra {
namespace {

constexpr const char* kSquareAndLamp =
    "mtllib room.mtl\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\n"
    "v -1 2 1\no floor\nusemtl grey\nf 4 3 2 1\no lamp\nusemtl lamp\nf 5 6 7 8\n";
constexpr const char* kMaterials = "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl lamp\nKe 5 5 5\n";

TEST_F(CommandLine, ModelFilesAreRenderedDirectlyAndThroughASceneFile) {
  write_file("room.mtl", kMaterials);
  write_file("room.obj", kSquareAndLamp);
  const Outcome direct = run("render room.obj --spp 1 --resolution 32 18 -o direct.png");
  EXPECT_EQ(direct.code, 0) << direct.output;
  EXPECT_TRUE(fs::exists(root_ / "direct.png"));
  EXPECT_NE(direct.output.find("no camera"), std::string::npos) << direct.output;

  write_file("scene.json", R"({"format": "penumbra-scene", "version": 1, "name": "room",
      "camera": {"position": [0, 1, 4], "look_at": [0, 0, 0]}, "include": [{"file": "room.obj"}]})");
  const Outcome included = run("render scene.json --spp 1 --resolution 32 18 -o included.png");
  EXPECT_EQ(included.code, 0) << included.output;
  EXPECT_TRUE(fs::exists(root_ / "included.png"));
}

TEST_F(CommandLine, FaultsOfModelFilesAreOneLineAndCode2) {
  write_file("room.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n");
  const Outcome outcome = run("render room.obj -o x.png");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.output.find("room.obj:3: error: vertex 3 does not exist"), std::string::npos)
      << outcome.output;
  EXPECT_EQ(std::count(outcome.output.begin(), outcome.output.end(), '\n'), 1) << outcome.output;
}

}  // namespace
}  // namespace penumbra
