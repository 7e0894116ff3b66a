// SPDX-License-Identifier: MIT
#include "bridge/precice/configuration.hpp"

#include "bridge/base/check.hpp"

#include <fmt/ranges.h>
#include <libxml/parser.h>
#include <libxml/tree.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <sstream>

namespace sluice::precice_layer {

namespace {

/// An element of the file; every attribute that is not asked for is an error.
class Element {
public:
  Element(const xmlNode *node, const std::string &file) : node_(node), file_(file) {}

  std::string name() const { return reinterpret_cast<const char *>(node_->name); }
  std::string place() const { return fmt::format("{}:{}", file_, node_->line); }
  [[noreturn]] void refuse(std::string_view where) const {
    fail("{}: <{}> in <{}> is not supported by Sluice's preCICE layer (bridge/precice/README.md "
         "lists what is)",
         place(), name(), where);
  }

  bool has(const char *attribute) const {
    return xmlHasProp(node_, reinterpret_cast<const xmlChar *>(attribute)) != nullptr;
  }
  std::string text(const char *attribute) const {
    check(has(attribute), "{}: <{}> needs the attribute '{}'", place(), name(), attribute);
    return value(attribute);
  }
  std::string text(const char *attribute, const std::string &otherwise) const {
    return has(attribute) ? value(attribute) : otherwise;
  }
  double number(const char *attribute) const {
    const std::string written = text(attribute);
    std::size_t read = 0;
    double number = 0;
    try {
      number = std::stod(written, &read);
    } catch (const std::exception &) {
      read = 0;
    }
    check(read == written.size() && read > 0, "{}: <{}> has {} = '{}', which is no number", place(),
          name(), attribute, written);
    return number;
  }
  double number(const char *attribute, double otherwise) const {
    return has(attribute) ? number(attribute) : otherwise;
  }
  bool flag(const char *attribute, bool otherwise) const {
    const std::string written = text(attribute, otherwise ? "true" : "false");
    const bool is_true = written == "true" || written == "1" || written == "yes" || written == "on";
    check(is_true || written == "false" || written == "0" || written == "no" || written == "off",
          "{}: <{}> has {} = '{}', which is neither true nor false", place(), name(), attribute,
          written);
    return is_true;
  }
  /// Throws for an attribute that is not in the list.
  void allow(std::initializer_list<std::string_view> attributes) const {
    for (const xmlAttr *a = node_->properties; a; a = a->next) {
      const std::string_view found = reinterpret_cast<const char *>(a->name);
      check(std::find(attributes.begin(), attributes.end(), found) != attributes.end(),
            "{}: the attribute '{}' of <{}> is not supported by Sluice's preCICE layer; it may "
            "have: {}",
            place(), found, name(), fmt::join(attributes, ", "));
    }
  }
  std::vector<Element> children() const {
    std::vector<Element> found;
    for (const xmlNode *child = node_->children; child; child = child->next)
      if (child->type == XML_ELEMENT_NODE)
        found.emplace_back(child, file_);
    return found;
  }

private:
  std::string value(const char *attribute) const {
    xmlChar *raw =
        xmlGetProp(const_cast<xmlNode *>(node_), reinterpret_cast<const xmlChar *>(attribute));
    const std::string copy = raw ? reinterpret_cast<const char *>(raw) : "";
    xmlFree(raw);
    return copy;
  }
  const xmlNode *node_;
  const std::string &file_;
};

using Readers = std::map<std::string, std::function<void(const Element &)>>;

// Every child has its reader, or is refused.
void read_children(const Element &parent, const Readers &readers) {
  for (const Element &child : parent.children()) {
    const auto reader = readers.find(child.name());
    if (reader == readers.end())
      child.refuse(parent.name());
    reader->second(child);
  }
}

void ignore(const Element &) {} // what changes no number: logs, timers

FieldName field_of(const Element &e) { return {e.text("name"), e.text("mesh")}; }

MapConfig read_map(const Element &e, bridge::MapKind kind) {
  e.allow({"direction", "from", "to", "constraint", "x-dead", "y-dead", "z-dead", "polynomial"});
  const auto one_of = [&](const char *attribute, const char *yes, const char *no) {
    const std::string value = e.text(attribute);
    check(value == yes || value == no, "{}: <{}> has {} = '{}'; supported are {} and {}", e.place(),
          e.name(), attribute, value, yes, no);
    return value == yes;
  };
  for (const Element &child : e.children())
    if (!child.name().starts_with("basis-function:"))
      child.refuse(e.name());
  return {kind, one_of("direction", "write", "read"),
          one_of("constraint", "conservative", "consistent"), e.text("from"), e.text("to")};
}

// "x;y" or "x;y;z".
std::vector<double> coordinates_of(const Element &e) {
  std::string written = e.text("coordinate");
  std::replace(written.begin(), written.end(), ';', ' ');
  std::istringstream in(written);
  std::vector<double> values;
  for (double value = 0; in >> value;)
    values.push_back(value);
  check(in.eof() && !values.empty(), "{}: <{}> has coordinate = '{}', expected x;y or x;y;z",
        e.place(), e.name(), e.text("coordinate"));
  return values;
}

ParticipantConfig read_participant(const Element &e) {
  e.allow({"name"});
  ParticipantConfig p;
  const auto map = [&](bridge::MapKind kind) {
    return [&p, kind](const Element &c) { p.maps.push_back(read_map(c, kind)); };
  };
  read_children(e,
                {{"provide-mesh",
                  [&](const Element &c) {
                    c.allow({"name"});
                    p.provided.push_back(c.text("name"));
                  }},
                 {"receive-mesh",
                  [&](const Element &c) {
                    c.allow({"name", "from"});
                    p.received[c.text("name")] = c.text("from");
                  }},
                 {"write-data",
                  [&](const Element &c) {
                    c.allow({"name", "mesh"});
                    p.written.push_back(field_of(c));
                  }},
                 {"read-data",
                  [&](const Element &c) {
                    c.allow({"name", "mesh"});
                    p.read.push_back(field_of(c));
                  }},
                 {"watch-point",
                  [&](const Element &c) {
                    c.allow({"name", "mesh", "coordinate"});
                    p.watch_points.push_back({c.text("name"), c.text("mesh"), coordinates_of(c)});
                  }},
                 {"mapping:nearest-neighbor", map(bridge::MapKind::nearest)},
                 {"mapping:nearest-projection", map(bridge::MapKind::projection)},
                 {"mapping:rbf", map(bridge::MapKind::rbf)},
                 {"mapping:rbf-pum-direct", map(bridge::MapKind::rbf)},
                 {"mapping:rbf-global-direct", map(bridge::MapKind::rbf)}});
  return p;
}

void read_acceleration(const Element &e, AccelerationConfig &a) {
  const std::map<std::string, std::string> kinds{{"acceleration:IQN-ILS", "iqn-ils"},
                                                 {"acceleration:IQN-IMVJ", "iqn-imvj"},
                                                 {"acceleration:aitken", "aitken"},
                                                 {"acceleration:constant", "constant"}};
  e.allow({});
  a.kind = kinds.at(e.name());
  a.relaxation = a.kind == "aitken" ? 0.5 : 0.1;
  const auto relaxation = [&](const Element &c) {
    c.allow({"value"});
    a.relaxation = c.number("value");
  };
  read_children(e, {{"data",
                     [&](const Element &c) {
                       c.allow({"name", "mesh"});
                       a.fields.push_back(field_of(c));
                     }},
                    {"initial-relaxation", relaxation},
                    {"relaxation", relaxation},
                    // Columns are limited by the number of unknowns, and by the windows below.
                    {"max-used-iterations", [](const Element &c) { c.allow({"value"}); }},
                    {"time-windows-reused",
                     [&](const Element &c) {
                       c.allow({"value"});
                       a.windows_reused = static_cast<int>(c.number("value"));
                     }},
                    {"filter",
                     [&](const Element &c) {
                       c.allow({"type", "limit"});
                       a.filter = c.number("limit", 1e-2);
                     }},
                    // Fields are scaled by their first change, whatever is asked for here.
                    {"preconditioner", [](const Element &c) { c.allow({"type"}); }}});
}

void read_scheme(const Element &e, Configuration &config) {
  check(config.first.empty(),
        "{}: a second coupling scheme; Sluice's preCICE layer couples two "
        "participants by one",
        e.place());
  e.allow({});
  config.is_parallel = e.name().find("parallel") != std::string::npos;
  config.is_implicit = e.name().ends_with("implicit");
  double windows = -1;
  const auto measure = [&](bool is_relative) {
    return [&config, is_relative](const Element &c) {
      c.allow({"limit", "data", "mesh"});
      config.measures.push_back({{c.text("data"), c.text("mesh")}, c.number("limit"), is_relative});
    };
  };
  const auto accelerate = [&](const Element &c) { read_acceleration(c, config.acceleration); };
  read_children(
      e,
      {{"participants",
        [&](const Element &c) {
          c.allow({"first", "second"});
          config.first = c.text("first");
          config.second = c.text("second");
        }},
       {"max-time",
        [&](const Element &c) {
          c.allow({"value"});
          config.end_time = c.number("value");
        }},
       {"max-time-windows",
        [&](const Element &c) {
          c.allow({"value"});
          windows = c.number("value");
        }},
       {"time-window-size",
        [&](const Element &c) {
          c.allow({"value", "method"});
          check(c.text("method", "fixed") == "fixed",
                "{}: time windows of a length that the first participant gives are not supported",
                c.place());
          config.window = c.number("value");
        }},
       {"min-iterations",
        [&](const Element &c) {
          c.allow({"value"});
          config.min_iterations = static_cast<int>(c.number("value"));
        }},
       {"max-iterations",
        [&](const Element &c) {
          c.allow({"value"});
          config.max_iterations = static_cast<int>(c.number("value"));
        }},
       {"exchange",
        [&](const Element &c) {
          c.allow({"data", "mesh", "from", "to", "initialize", "substeps"});
          config.exchanges.push_back({{c.text("data"), c.text("mesh")},
                                      c.text("from"),
                                      c.text("to"),
                                      c.flag("initialize", false)});
        }},
       {"relative-convergence-measure", measure(true)},
       {"absolute-convergence-measure", measure(false)},
       {"acceleration:IQN-ILS", accelerate},
       {"acceleration:IQN-IMVJ", accelerate},
       {"acceleration:aitken", accelerate},
       {"acceleration:constant", accelerate}});
  check(!config.first.empty(), "{}: <{}> needs <participants>", e.place(), e.name());
  check(config.window > 0, "{}: <{}> needs <time-window-size> above zero", e.place(), e.name());
  if (windows > 0) {
    const double end = windows * config.window;
    config.end_time = config.end_time > 0 ? std::min(config.end_time, end) : end;
  }
  check(config.end_time > 0, "{}: <{}> needs <max-time> or <max-time-windows>", e.place(),
        e.name());
}

void read_root(const Element &root, Configuration &config) {
  check(root.name() == "precice-configuration",
        "{}: the file's element is <{}>, not "
        "<precice-configuration>",
        root.place(), root.name());
  root.allow({"experimental", "wait-in-finalize"});
  const auto data = [&](int components) {
    return [&config, components](const Element &c) {
      c.allow({"name"});
      config.data[c.text("name")] = components;
    };
  };
  const auto scheme = [&](const Element &c) { read_scheme(c, config); };
  read_children(
      root,
      {{"log", ignore},
       {"profiling", ignore},
       {"data:scalar", data(1)},
       {"data:vector", data(0)},
       {"mesh",
        [&](const Element &c) {
          c.allow({"name", "dimensions"});
          MeshConfig mesh{static_cast<int>(c.number("dimensions")), {}};
          check(mesh.dimensions == 2 || mesh.dimensions == 3,
                "{}: a mesh has 2 or 3 dimensions, not {}", c.place(), mesh.dimensions);
          read_children(c, {{"use-data", [&](const Element &u) {
                               u.allow({"name"});
                               check(config.data.contains(u.text("name")),
                                     "{}: there is no <data:...> '{}'", u.place(), u.text("name"));
                               mesh.data.push_back(u.text("name"));
                             }}});
          config.meshes[c.text("name")] = mesh;
        }},
       {"participant",
        [&](const Element &c) { config.participants[c.text("name")] = read_participant(c); }},
       {"m2n:sockets",
        [&](const Element &c) {
          c.allow({"acceptor", "connector", "exchange-directory", "network", "port",
                   "enforce-gather-scatter", "use-two-level-initialization"});
          config.acceptor = c.text("acceptor");
          config.connector = c.text("connector");
          config.exchange_directory = c.text("exchange-directory", ".");
          const std::string network = c.text("network", "lo");
          check(network == "lo" && !(c.has("port") && c.number("port") != 0),
                "{}: both participants must run on one host, at a place that exchange-directory "
                "gives; network and port are not supported",
                c.place());
        }},
       {"coupling-scheme:serial-explicit", scheme},
       {"coupling-scheme:serial-implicit", scheme},
       {"coupling-scheme:parallel-explicit", scheme},
       {"coupling-scheme:parallel-implicit", scheme}});
}

void check_names(const Configuration &config, const std::string &file) {
  for (const std::string &name : {config.first, config.second, config.acceptor, config.connector})
    check(config.participants.contains(name), "{}: there is no <participant> '{}'", file, name);
  for (const auto &[name, p] : config.participants) {
    for (const WatchPoint &point : p.watch_points)
      check(std::find(p.provided.begin(), p.provided.end(), point.mesh) != p.provided.end() &&
                static_cast<int>(point.coordinate.size()) ==
                    config.meshes.at(point.mesh).dimensions,
            "{}: the watch-point '{}' needs a mesh that {} provides, and as many coordinates", file,
            point.name, name);
    for (const auto &mesh : p.provided)
      check(config.meshes.contains(mesh), "{}: there is no <mesh> '{}' for participant '{}'", file,
            mesh, name);
    for (const auto *fields : {&p.written, &p.read})
      for (const FieldName &field : *fields)
        config.components(field);
  }
  for (const Exchange &e : config.exchanges)
    config.components(e.field);
}

using Document = std::unique_ptr<xmlDoc, void (*)(xmlDocPtr)>;

// The first error that ends the parse. (That nobody declares preCICE's name spaces is none.)
void note_error(void *context, xmlErrorPtr error) {
  auto &first = *static_cast<std::string *>(static_cast<xmlParserCtxtPtr>(context)->_private);
  if (error->level == XML_ERR_FATAL && first.empty())
    first = fmt::format("{}: {}", error->line, error->message);
}

Document parsed(const std::string &text, const std::string &file) {
  const std::unique_ptr<xmlParserCtxt, void (*)(xmlParserCtxtPtr)> context(xmlNewParserCtxt(),
                                                                           &xmlFreeParserCtxt);
  check(context != nullptr, "{}: no memory to read it", file);
  std::string error;
  context->_private = &error;
  context->sax->serror = &note_error;
  Document document(xmlCtxtReadMemory(context.get(), text.data(), static_cast<int>(text.size()),
                                      file.c_str(), nullptr, XML_PARSE_NONET | XML_PARSE_BIG_LINES),
                    &xmlFreeDoc);
  check(document != nullptr, "{}:{}", file, error.empty() ? "1: not XML" : error);
  return document;
}

} // namespace

int Configuration::components(const FieldName &field) const {
  const auto mesh = meshes.find(field.mesh);
  check(mesh != meshes.end(), "precice: there is no mesh '{}'", field.mesh);
  const auto &names = mesh->second.data;
  check(std::find(names.begin(), names.end(), field.data) != names.end(),
        "precice: the mesh '{}' has no data '{}', only: {}", field.mesh, field.data,
        fmt::join(names, ", "));
  const int components = data.at(field.data);
  return components > 0 ? components : mesh->second.dimensions;
}

Configuration read_configuration(const std::filesystem::path &path) {
  const std::string file = path.string();
  std::ifstream in(path, std::ios::binary);
  check(in.good(), "{}: there is no such file", file);
  std::ostringstream text;
  text << in.rdbuf();
  Configuration config;
  config.text = text.str();
  const auto document = parsed(config.text, file);
  read_root(Element(xmlDocGetRootElement(document.get()), file), config);
  check(!config.first.empty(), "{}: there is no <coupling-scheme:...>", file);
  check(!config.acceptor.empty(), "{}: there is no <m2n:sockets>", file);
  check_names(config, file);
  return config;
}

} // namespace sluice::precice_layer
