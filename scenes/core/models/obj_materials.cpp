#include "scenes/core/models/obj_materials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <istream>
#include <utility>

#include "scenes/core/file_bytes.h"

namespace penumbra {
namespace {

/// Statements with numbers, and how many of them. tinyobjloader reads fewer as zeros.
struct NumberStatement {
  std::string_view keyword;
  int numbers;
};
constexpr std::array<NumberStatement, 18> kNumberStatements{{{"Ka", 3},
                                                             {"Kd", 3},
                                                             {"Ks", 3},
                                                             {"Ke", 3},
                                                             {"Kt", 3},
                                                             {"Tf", 3},
                                                             {"Ni", 1},
                                                             {"Ns", 1},
                                                             {"d", 1},
                                                             {"Tr", 1},
                                                             {"illum", 1},
                                                             {"Pr", 1},
                                                             {"Pm", 1},
                                                             {"Ps", 1},
                                                             {"Pc", 1},
                                                             {"Pcr", 1},
                                                             {"aniso", 1},
                                                             {"anisor", 1}}};

/// Statements that decide nothing here: ambient light, refraction, filters of textures; and those
/// that are read.
constexpr std::array<std::string_view, 11> kSilent{"Ka", "Ni", "map_Ka", "sharpness", "Kd", "Ks",
                                                   "Ke", "Ns", "illum",  "Pr",        "Pm"};
constexpr std::array<std::string_view, 4> kTextures{"map_Kd", "map_Pr", "map_Pm", "map_d"};

bool is_black_color(const tinyobj::real_t (&c)[3]) { return c[0] == 0 && c[1] == 0 && c[2] == 0; }

float max_channel(const Rgb& c) { return std::max({c.x, c.y, c.z}); }

}  // namespace

void ObjMaterials::add_libraries(std::string_view names, int line) {
  const std::filesystem::path folder = builder_.file().parent_path();
  // A name may hold spaces, and a statement may hold several names.
  const std::string whole = joined_words(names);
  std::vector<std::string> files{whole};
  if (std::error_code ignored; !std::filesystem::exists(folder / whole, ignored)) {
    files.clear();
    for (std::string_view word = take_word(names); !word.empty(); word = take_word(names)) {
      files.emplace_back(word);
    }
  }
  for (const std::string& name : files) {
    if (std::error_code ignored; std::filesystem::exists(folder / name, ignored)) {
      read_library(folder / name);
    } else {
      builder_.warn_of_material("line " + std::to_string(line) + ": material library \"" + name +
                                "\" does not exist; its materials are grey");
    }
  }
}

void ObjMaterials::read_library(const std::filesystem::path& library) {
  if (!libraries_.insert(library).second) return;
  Entry* entry = nullptr;
  std::map<std::string, int> ids;
  std::vector<tinyobj::material_t> materials;
  std::string warnings, errors;
  std::vector<Entry*> order;
  StatementLines* lines_seen = nullptr;
  StatementLines lines(library, read_bytes(library), [&](std::string_view statement) {
    const Entry* const before = entry;
    check_statement(*lines_seen, statement, entry);
    if (entry != before) order.push_back(entry);
  });
  lines_seen = &lines;
  std::istream stream(&lines);
  stream.exceptions(std::ios::badbit);
  tinyobj::LoadMtl(&ids, &materials, &stream, &warnings, &errors);
  if (!errors.empty()) model_error(library, errors);
  // Both have one element per "newmtl" with a name; the library adds one where there is none.
  for (std::size_t i = 0; i < order.size() && i < materials.size(); ++i) {
    order[i]->values = std::move(materials[i]);
  }
}

void ObjMaterials::check_statement(const StatementLines& lines, std::string_view rest,
                                   Entry*& entry) {
  const std::string keyword(take_word(rest));
  if (keyword == "newmtl") {
    const std::string name = joined_words(rest);
    if (name.empty()) model_error(lines.file(), lines.line(), "\"newmtl\" without a name");
    const auto [found, added] = entries_.try_emplace(name);
    if (!added) {
      model_error(lines.file(), lines.line(), "material \"" + name + "\" is defined twice");
    }
    entry = &found->second;
    entry->library = lines.file();
    entry->line = lines.line();
    return;
  }
  for (const auto& [known, numbers] : kNumberStatements) {
    if (keyword == known) check_numbers(lines, keyword, rest, numbers, numbers);
  }
  if (entry == nullptr) {
    model_error(lines.file(), lines.line(), "\"" + keyword + "\" before the first \"newmtl\"");
  }
  entry->statements[keyword] = std::string(rest);
}

std::uint32_t ObjMaterials::use(const std::string& name) {
  const auto index = static_cast<std::uint32_t>(emissions_.size());
  const auto [found, added] = used_.try_emplace(name, index);
  if (!added) return found->second;
  std::optional<EmissionDescription> emission;
  MaterialDescription material{name.empty() ? "default" : name, LambertMaterial{}};
  if (const auto entry = entries_.find(name); entry != entries_.end()) {
    material = convert(entry->second, emission);
    material.name = name;
  } else {
    builder_.warn_of_material(name.empty()
                                  ? "faces before the first \"usemtl\" are grey"
                                  : "material \"" + name + "\" is not defined; it is grey");
  }
  builder_.model().materials.push_back(std::move(material));
  emissions_.push_back(emission);
  return index;
}

MaterialDescription ObjMaterials::convert(const Entry& entry,
                                          std::optional<EmissionDescription>& emission) {
  MaterialDescription material;
  set_reflection(entry, material);
  set_textures(entry, material);
  if (!is_black_color(entry.values.emission)) {
    emission = EmissionDescription{color(entry, entry.values.emission, "Ke"), false};
  }
  warn_unsupported(entry);
  return material;
}

void ObjMaterials::set_reflection(const Entry& entry, MaterialDescription& material) {
  const auto given = [&](const char* keyword) { return entry.statements.contains(keyword); };
  const tinyobj::material_t& values = entry.values;
  Rgb diffuse = color(entry, values.diffuse, "Kd");
  // Where only a texture is given, it is the whole colour.
  if (given("map_Kd") && !given("Kd")) diffuse = Rgb(1.0f);
  const Rgb specular = color(entry, values.specular, "Ks");
  if (given("Pr") || given("Pm") || given("map_Pr") || given("map_Pm")) {
    for (int c = 0; c < 3; ++c) share(entry, static_cast<double>(diffuse[c]), "Kd", diffuse[c]);
    material.model = MetallicRoughnessMaterial{
        diffuse, share(entry, values.metallic, "Pm", given("map_Pm") ? 1.0f : 0.0f),
        share(entry, values.roughness, "Pr", 1.0f)};
    return;
  }
  // Models 0 and 1 have no highlight whatever Ks says.
  const bool has_highlight = !is_black(specular) && (!given("illum") || values.illum >= 2);
  if (has_highlight && values.illum == 3 && is_black(diffuse) && max_channel(specular) <= 1.0f) {
    material.model = MirrorMaterial{specular};
  } else if (has_highlight && given("Ns")) {
    material.model = phong(entry, diffuse, specular);
  } else {
    if (has_highlight) {
      builder_.warn_of_material("material \"" + values.name +
                                "\": \"Ks\" without \"Ns\" is left out");
    }
    material.model = LambertMaterial{phong(entry, diffuse, Rgb(0.0f)).diffuse};
  }
}

PhongMaterial ObjMaterials::phong(const Entry& entry, Rgb diffuse, Rgb specular) {
  const float sum = max_channel(diffuse + specular);
  if (sum > 1.0f + 1e-6f) {
    builder_.warn_of_material("material \"" + entry.values.name + "\": Kd + Ks reaches " +
                              std::to_string(sum) + " and is scaled to 1");
    diffuse *= 1.0f / sum;
    specular *= 1.0f / sum;
  }
  const double exponent = std::clamp(entry.values.shininess, 1.0, 1e6);
  if (!is_black(specular) && exponent != entry.values.shininess) {
    builder_.warn_of_material("material \"" + entry.values.name + "\": Ns " +
                              std::to_string(entry.values.shininess) +
                              " is outside [1, 1e6] and taken as " + std::to_string(exponent));
  }
  return {diffuse, specular, static_cast<float>(exponent)};
}

void ObjMaterials::set_textures(const Entry& entry, MaterialDescription& material) {
  const tinyobj::material_t& values = entry.values;
  const bool is_mirror = std::holds_alternative<MirrorMaterial>(material.model);
  if (!values.diffuse_texname.empty() && !is_mirror) {
    material.reflectance_texture =
        texture(entry, values.diffuse_texname, values.diffuse_texopt, "map_Kd");
    material.reflectance_texture->srgb = true;
  }
  if (!values.roughness_texname.empty()) {
    material.roughness_texture =
        texture(entry, values.roughness_texname, values.roughness_texopt, "map_Pr");
  }
  if (!values.metallic_texname.empty()) {
    material.metallic_texture =
        texture(entry, values.metallic_texname, values.metallic_texopt, "map_Pm");
  }
  if (!values.alpha_texname.empty()) {
    MaskDescription mask{texture(entry, values.alpha_texname, values.alpha_texopt, "map_d"), 0.5f};
    // The colours' own image holds the holes in its alpha channel.
    if (material.reflectance_texture && material.reflectance_texture->file == mask.texture.file) {
      mask.texture.channel = 3;
    }
    material.mask = mask;
  }
}

TextureDescription ObjMaterials::texture(const Entry& entry, const std::string& name,
                                         const tinyobj::texture_option_t& options,
                                         const char* keyword) {
  std::string path = name.substr(0, name.find_last_not_of(" \t\r") + 1);
  std::replace(path.begin(), path.end(), '\\', '/');
  TextureDescription texture =
      builder_.texture(entry.library.parent_path() / path,
                       entry.library.string() + ":" + std::to_string(entry.line), keyword);
  if (options.clamp) texture.wrap_u = texture.wrap_v = TextureWrap::Clamp;
  const std::string& statement = entry.statements.at(keyword);
  if (statement.find("-imfchan") != std::string::npos) {
    const std::size_t channel = std::string_view("rgbm").find(options.imfchan);
    if (channel == std::string_view::npos) {
      model_error(entry.library, entry.line,
                  std::string(keyword) + ": expected -imfchan r, g, b or m, found \"" +
                      options.imfchan + "\"");
    }
    texture.channel = static_cast<int>(channel);
  }
  const auto& o = options.origin_offset;
  const auto& s = options.scale;
  if (o[0] != 0 || o[1] != 0 || s[0] != 1 || s[1] != 1 || options.brightness != 0 ||
      options.contrast != 1 || options.turbulence[0] != 0 || options.turbulence[1] != 0) {
    builder_.warn_of_material("material \"" + entry.values.name +
                              "\": the options -o, -s, -t and -mm of " + keyword +
                              " are not supported and left out");
  }
  return texture;
}

void ObjMaterials::warn_unsupported(const Entry& entry) {
  const tinyobj::material_t& values = entry.values;
  if (entry.statements.contains("map_Ke")) {
    // Left out, the light would be another one.
    model_error(entry.library, entry.line,
                "material \"" + values.name +
                    "\": an emission with a texture (\"map_Ke\") is not supported; give \"Ke\"");
  }
  if (values.dissolve < 1.0) {
    builder_.warn_of_material("material \"" + values.name + "\" is transparent (d " +
                              std::to_string(values.dissolve) + "); it is taken as opaque");
  }
  for (const auto& [keyword, rest] : entry.statements) {
    const auto is_one_of = [&name = keyword](const auto& list) {
      return std::find(list.begin(), list.end(), name) != list.end();
    };
    if (is_one_of(kSilent) || is_one_of(kTextures) || keyword == "d" || keyword == "Tr") continue;
    const bool is_number = keyword[0] == 'P' || keyword.starts_with("aniso");
    if (is_number && rest.find_first_of("123456789") == std::string::npos) continue;
    builder_.warn_of_material("material \"" + values.name + "\": \"" + keyword +
                              "\" is not supported and left out");
  }
}

Rgb ObjMaterials::color(const Entry& entry, const tinyobj::real_t (&values)[3],
                        const char* keyword) const {
  for (const tinyobj::real_t value : values) {
    if (value >= 0.0 && value <= 1e30) continue;
    model_error(entry.library, entry.line,
                "material \"" + entry.values.name + "\": expected numbers >= 0 after \"" + keyword +
                    "\", found " + std::to_string(value));
  }
  return {static_cast<float>(values[0]), static_cast<float>(values[1]),
          static_cast<float>(values[2])};
}

float ObjMaterials::share(const Entry& entry, double value, const char* keyword,
                          float missing) const {
  if (!entry.statements.contains(keyword)) return missing;
  if (!(value >= 0.0 && value <= 1.0)) {
    model_error(entry.library, entry.line,
                "material \"" + entry.values.name + "\": expected a number in [0, 1] after \"" +
                    keyword + "\", found " + std::to_string(value));
  }
  return static_cast<float>(value);
}

}  // namespace penumbra
