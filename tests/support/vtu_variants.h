/// A .vtu file as VTK's own writer stores it in every way that its programs offer.
#pragma once

#include <vtkDataCompressor.h>
#include <vtkNew.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include "tests/support/test.h"

namespace mbtfm::test {

enum class VtuMode { ascii, binary, appended_base64, appended_raw };

struct VtuVariant {
  VtuMode mode = VtuMode::appended_raw;
  vtkXMLWriterBase::CompressorType compressor = vtkXMLWriterBase::ZLIB;
  bool is_big_endian = false;
  bool has_long_sizes = false;  ///< 64 bits each
  int block_bytes = 0;          ///< of compressed data; 0: VTK's own

  std::string name() const {
    const char* const modes[] = {"ascii", "binary", "appended base64", "appended raw"};
    return std::string(modes[static_cast<int>(mode)]) + ", compressor " + std::to_string(compressor) +
           (is_big_endian ? ", big endian" : "") + (has_long_sizes ? ", long sizes" : "") + ", blocks of " +
           std::to_string(block_bytes);
  }
};

inline std::vector<VtuVariant> vtu_variants() {
  std::vector<VtuVariant> variants;
  for (const VtuMode mode : {VtuMode::ascii, VtuMode::binary, VtuMode::appended_base64, VtuMode::appended_raw})
    for (const auto compressor : {vtkXMLWriterBase::NONE, vtkXMLWriterBase::ZLIB, vtkXMLWriterBase::LZ4})
      for (const bool is_big_endian : {false, true})
        for (const bool has_long_sizes : {false, true})
          for (const int block_bytes : {0, 64})
            variants.push_back({mode, compressor, is_big_endian, has_long_sizes, block_bytes});
  return variants;
}

inline std::string stored_as(const std::string& vtu, const VtuVariant& variant) {
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetReadFromInputString(true);
  reader->SetInputString(vtu);
  reader->Update();
  vtkNew<vtkXMLUnstructuredGridWriter> writer;
  writer->SetInputData(reader->GetOutput());
  writer->SetWriteToOutputString(true);
  writer->SetCompressorType(variant.compressor);
  if (variant.block_bytes > 0) writer->SetBlockSize(static_cast<std::size_t>(variant.block_bytes));
  variant.is_big_endian ? writer->SetByteOrderToBigEndian() : writer->SetByteOrderToLittleEndian();
  variant.has_long_sizes ? writer->SetHeaderTypeToUInt64() : writer->SetHeaderTypeToUInt32();
  if (variant.mode == VtuMode::ascii) writer->SetDataModeToAscii();
  if (variant.mode == VtuMode::binary) writer->SetDataModeToBinary();
  if (variant.mode == VtuMode::appended_base64 || variant.mode == VtuMode::appended_raw)
    writer->SetDataModeToAppended();
  writer->SetEncodeAppendedData(variant.mode == VtuMode::appended_base64);
  writer->Write();
  return writer->GetOutputString();
}

}  // namespace mbtfm::test
